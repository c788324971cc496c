// SPDX-License-Identifier: Apache-2.0
#include "workbench/report/plot.hpp"

#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace plot_test {

using namespace loopwarden::workbench;

namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

PlotRange range(const std::vector<double>& values, double margin) {
  const std::span<const double> column(values);
  return range_of(std::span(&column, 1), margin);
}

}  // namespace

TEST_CASE("the range holds all finite values", "[workbench][plot]") {
  const PlotRange r = range({1.0, kNan, 3.0, std::numeric_limits<double>::infinity()}, 0.1);
  CHECK(r.low == Approx(0.8));
  CHECK(r.high == Approx(3.2));
  CHECK(r.down(3.2) == Approx(0.0).margin(1e-9));
  CHECK(r.down(0.8) == Approx(kPlotHeight));
  CHECK(range({}, 0.1).span() == 1.0);
  CHECK(range({kNan}, 0.1).span() == 1.0);
  const PlotRange constant = range({5.0, 5.0}, 0.1);
  CHECK(constant.low < 5.0);
  CHECK(constant.high > 5.0);
  CHECK(range({0.0}, 0.0).span() > 0.0);
}

TEST_CASE("ticks are round numbers within the range", "[workbench][plot]") {
  std::string text;
  for (const Tick& tick : ticks({-0.3, 1.05}, 6)) text += tick.text + " ";
  CHECK(text == "0.0 0.5 1.0 ");
  text.clear();
  for (const Tick& tick : ticks({0.0, 600.0}, 6)) text += tick.text + " ";
  CHECK(text == "0 100 200 300 400 500 600 ");
  text.clear();
  for (const Tick& tick : ticks({0.0121, 0.0139}, 4)) text += tick.text + " ";
  CHECK(text == "0.0125 0.0130 0.0135 ");
}

TEST_CASE("decimation keeps each peak and leaves gaps open", "[workbench][plot]") {
  std::vector<double> values(10'000, 0.5);
  for (std::size_t k = 0; k < values.size(); ++k) values[k] += 0.1 * std::sin(double(k));
  values[4321] = 1.0;
  values[8765] = 0.0;
  for (std::size_t k = 6000; k < 6500; ++k) values[k] = kNan;
  const std::vector<PlotPoint> points = decimated(values, {0.0, 1.0}, 100);
  CHECK(points.size() <= 200);
  const auto has = [&](std::int64_t x, std::int64_t y) {
    return std::any_of(points.begin(), points.end(),
                       [&](const PlotPoint& p) { return p.x == x && p.y == y; });
  };
  CHECK(has(4321, 0));
  CHECK(has(8765, 10'000));
  int pieces = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    pieces += points[i].starts ? 1 : 0;
    CHECK((points[i].x < 6000 || points[i].x >= 6500));
    if (i > 0) CHECK(points[i].x > points[i - 1].x);
  }
  CHECK(pieces == 2);
}

TEST_CASE("a set point takes one point per corner", "[workbench][plot]") {
  const std::vector<double> values{0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0};
  const std::vector<PlotPoint> points = decimated(values, {0.0, 1.0}, 100);
  CHECK(points == std::vector<PlotPoint>{
                      {0, 10'000, true}, {2, 10'000, false}, {3, 0, false}, {6, 0, false}});
  CHECK(path_data(points) == "M0 10000l2 0 1-10000 3 0");
}

TEST_CASE("a path has one piece per measured stretch", "[workbench][plot]") {
  const std::vector<double> values{0.0, kNan, 1.0, 0.5};
  CHECK(path_data(decimated(values, {0.0, 1.0}, 100)) == "M0 10000M2 0l1 5000");
  CHECK(path_data({}) == "");
}

TEST_CASE("numbers and text for people", "[workbench][plot]") {
  CHECK(plain_number(0.123456) == "0.1235");
  CHECK(plain_number(-0.0) == "0");
  CHECK(plain_number(kNan) == "-");
  CHECK(plain_number(-std::numeric_limits<double>::infinity()) == "-");
  CHECK(escaped("<a href='x'>\"&\n") == "&lt;a href=&#39;x&#39;&gt;&quot;&amp;\n");
  CHECK(escaped(std::string("a\0b\x1b", 4)) ==
        "a\xef\xbf\xbd"
        "b\xef\xbf\xbd");
}

TEST_CASE("a simplified curve stays within its tolerance", "[workbench][plot]") {
  const std::vector<PlotPoint> points{{0, 0, true},   {1, 1, false},   {2, -1, false},
                                      {10, 0, false}, {20, 50, false}, {30, 0, false},
                                      {100, 7, true}, {200, 7, false}, {100, 7, false}};
  CHECK(simplified(points, 2.0) == std::vector<PlotPoint>{{0, 0, true},
                                                          {10, 0, false},
                                                          {20, 50, false},
                                                          {30, 0, false},
                                                          {100, 7, true},
                                                          {200, 7, false},
                                                          {100, 7, false}});
  CHECK(simplified(points, 0.5).size() == points.size());
  CHECK(simplified({}, 1.0).empty());
}

}  // namespace plot_test
