// SPDX-License-Identifier: Apache-2.0
#include "workbench/report/chart.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstddef>
#include <limits>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "tests/workbench/report/gap_result_support.hpp"
#include "workbench/report/effect_picture.hpp"
#include "workbench/report/gap_report.hpp"
#include "workbench/report/training_page.hpp"

namespace loopwarden::tests::chart_test {
namespace {

using namespace loopwarden::workbench;

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

Chart chart_of(std::vector<double> x, std::vector<double> y) {
  Chart chart{.title = "t", .x_label = "s", .y_label = "V"};
  chart.lines.push_back({.name = "one", .x = std::move(x), .y = std::move(y)});
  return chart;
}

// Returns the number of separate pieces in the path of the first curve.
std::size_t pieces(const std::string& svg) {
  const std::size_t begin = svg.find("<path class=\"l\"");
  REQUIRE(begin != std::string::npos);
  const std::string path = svg.substr(begin, svg.find("/>", begin) - begin);
  return static_cast<std::size_t>(std::count(path.begin(), path.end(), 'M'));
}

std::set<std::string> colours_in(const std::string& text) {
  static const std::regex kColour("#[0-9a-f]{6}\\b");
  return {std::sregex_token_iterator(text.begin(), text.end(), kColour), {}};
}

TEST_CASE("a gap in a curve is a gap in its path, also among many samples", "[report]") {
  for (const std::size_t samples : {std::size_t{100}, std::size_t{50'000}}) {
    INFO(samples);
    std::vector<double> y(samples);
    for (std::size_t k = 0; k < samples; ++k) y[k] = std::sin(0.01 * static_cast<double>(k));
    const std::vector<double> x = time_axis(samples, 0.1);
    CHECK(pieces(chart_svg(chart_of(x, y))) == 1);
    for (std::size_t k = samples / 2; k < samples * 6 / 10; ++k) {
      y[k] = std::numeric_limits<double>::quiet_NaN();
    }
    CHECK(pieces(chart_svg(chart_of(x, y))) == 2);
  }
}

TEST_CASE("a single peak among many samples is drawn", "[report]") {
  std::vector<double> y(100'000, 1.0);
  const std::vector<double> x = time_axis(y.size(), 0.1);
  const std::string flat = chart_svg(chart_of(x, y));
  y[54'321] = 2.0;
  Chart chart = chart_of(x, y);
  chart.y_range = PlotRange{0.0, 2.0};
  // A curve over the height of the frame, in tenths, up and down.
  const std::string svg = chart_svg(chart);
  CHECK(svg.size() < flat.size() + 400);
  CHECK(std::regex_search(svg, std::regex("d=\"M0 1000l\\d+ 0")));
  CHECK(contains(svg, "-1000"));
}

TEST_CASE("a curve over a quantity other than time keeps all of its samples", "[report]") {
  // Ten rounds of a circle. Thinning only by its height would remove its sides.
  std::vector<double> x;
  std::vector<double> y;
  for (int k = 0; k < 6000; ++k) {
    x.push_back(std::cos(0.0104719755 * k));
    y.push_back(std::sin(0.0104719755 * k));
  }
  const std::string svg = chart_svg(chart_of(x, y));
  const std::size_t begin = svg.find(" d=\"", svg.find("class=\"l\"")) + 4;
  const std::string path = svg.substr(begin, svg.find('"', begin) - begin);
  CHECK(std::count(path.begin(), path.end(), ' ') > 200);
  CHECK(pieces(svg) == 1);
}

TEST_CASE("logarithmic axes are labelled with the quantity", "[report]") {
  Chart chart = chart_of({0.0, 1.0, 2.0}, {-3.0, -2.0, -1.0});
  chart.logarithmic_x = chart.logarithmic_y = true;
  const std::string svg = chart_svg(chart);
  CHECK(contains(svg, ">10</text>"));
  CHECK(contains(svg, ">100</text>"));
  CHECK(contains(svg, ">0.01</text>"));
}

TEST_CASE("bands end at the axes, and levels beyond them are not drawn", "[report]") {
  Chart chart = chart_of({0.0, 10.0}, {0.0, 1.0});
  const std::string plain = chart_svg(chart);
  chart.bands.push_back({.from = -50.0, .to = 50.0, .meaning = "all <of> it"});
  chart.levels = {7.0};
  const std::string svg = chart_svg(chart);
  CHECK(contains(svg, "<title>all &lt;of&gt; it</title>"));
  // The picture is as wide as the frame.
  CHECK(contains(svg, "width=\"498.0\" height=\"200.0\"><title>all"));
  CHECK_FALSE(contains(svg, "<path class=\"v\""));
  chart.levels = {0.5};
  CHECK(contains(chart_svg(chart), "<path class=\"v\""));
}

TEST_CASE("rows of a sheet are as high as their content", "[report]") {
  Chart high = chart_of({0.0, 1.0}, {0.0, 1.0});
  Chart low = high;
  high.height = 400.0;
  low.height = 100.0;
  const double top = kSheetTitle + chart_height(high);
  CHECK(contains(chart_sheet("two", {high, low}, 1),
                 "translate(0 " + std::to_string(static_cast<int>(top)) + ")"));
  CHECK(contains(chart_sheet("two", {high, low}, 2), "translate(560 26)"));
}

TEST_CASE("every colour of pictures and pages is one of the palette", "[report]") {
  std::set<std::string> known = colours_in(palette_style());
  for (std::size_t i = 0; i < 8; ++i) known.insert(chart_colour(i));
  TrainingResult training;
  training.team_epochs.resize(3);
  const gap::Result result = complete_gap_result();
  for (const std::string& text :
       {chart_svg(chart_of({0.0, 1.0}, {0.0, 1.0})), effect_picture_svg(effect_examples().front()),
        training_page(training), html_page("a", "b"),
        // Excludes uPlot's code, because the page's style replaces its colours.
        gap_report_html(result, {}).substr(0, gap_report_html(result, {}).find("<footer>"))}) {
    for (const std::string& colour : colours_in(text)) {
      INFO(colour << " in " << text.substr(0, 80));
      CHECK(known.contains(colour));
    }
  }
}

}  // namespace
}  // namespace loopwarden::tests::chart_test
