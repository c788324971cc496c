// SPDX-License-Identifier: Apache-2.0
#include "workbench/report/chart.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <fstream>
#include <iterator>
#include <span>
#include <stdexcept>

namespace loopwarden::workbench {
namespace {

constexpr double kLeft = 52.0;
constexpr double kLeftOfNames = 92.0;
constexpr double kRight = 10.0;
constexpr double kTop = 26.0;
constexpr double kBottom = 34.0;
constexpr double kLegendLine = 15.0;
constexpr std::size_t kMostPoints = 1400;  // of a line; the least and the greatest of more

const char* const kStyle =
    "<style>text{font:11px system-ui,sans-serif;fill:#5b6570}text.t{fill:#1b1f24}"
    "text.h{fill:#1b1f24;font-weight:600;font-size:12px}.l{fill:none;stroke-width:1.5;"
    "stroke-linejoin:round}.g{stroke:#e7eaee}.f{fill:none;stroke:#b8bec5}</style>\n";

PlotRange range_over(const Chart& chart, bool across) {
  std::vector<std::span<const double>> columns;
  for (const ChartLine& line : chart.lines) columns.emplace_back(across ? line.x : line.y);
  return range_of(columns, across ? 0.0 : 0.06);
}

// Of each stretch of samples the least and the greatest, in their order.
std::vector<std::size_t> kept(const std::vector<double>& y) {
  std::vector<std::size_t> indices;
  const std::size_t n = y.size();
  if (n <= kMostPoints) {
    for (std::size_t k = 0; k < n; ++k) indices.push_back(k);
    return indices;
  }
  const std::size_t buckets = kMostPoints / 2;
  for (std::size_t b = 0; b < buckets; ++b) {
    const std::size_t from = b * n / buckets;
    const std::size_t to = (b + 1) * n / buckets;
    const auto begin = y.begin() + static_cast<std::ptrdiff_t>(from);
    const auto end = y.begin() + static_cast<std::ptrdiff_t>(to);
    const auto [least, most] = std::minmax_element(begin, end);
    const auto first = static_cast<std::size_t>(std::min(least, most) - y.begin());
    const auto last = static_cast<std::size_t>(std::max(least, most) - y.begin());
    indices.push_back(first);
    if (last != first) indices.push_back(last);
  }
  return indices;
}

std::string legend(const Chart& chart) {
  std::string text;
  double at = kLeft;
  double line_y = chart.height - 4.0;
  for (const ChartLine& line : chart.lines) {
    if (line.name.empty()) continue;
    const double needs = 30.0 + 6.2 * static_cast<double>(line.name.size());
    if (at + needs > chart.width && at > kLeft) {
      at = kLeft;
      line_y += kLegendLine;
    }
    fmt::format_to(std::back_inserter(text),
                   "<path class=\"l\" stroke=\"{}\"{} d=\"M{:.0f} {:.0f}h16\"/><text x=\"{:.0f}\" "
                   "y=\"{:.0f}\">{}</text>\n",
                   line.colour, line.dashed ? " stroke-dasharray=\"5 3\"" : "", at, line_y - 4.0,
                   at + 20.0, line_y, escaped(line.name));
    at += needs;
  }
  return text;
}

std::size_t legend_lines(const Chart& chart) {
  std::size_t lines = 0;
  double at = kLeft;
  for (const ChartLine& line : chart.lines) {
    if (line.name.empty()) continue;
    if (lines == 0) lines = 1;
    const double needs = 30.0 + 6.2 * static_cast<double>(line.name.size());
    if (at + needs > chart.width && at > kLeft) {
      at = kLeft;
      ++lines;
    }
    at += needs;
  }
  return lines;
}

double whole_height(const Chart& chart) {
  return chart.height + kLegendLine * static_cast<double>(legend_lines(chart));
}

}  // namespace

const char* chart_colour(std::size_t index) {
  constexpr std::array kColours{"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                "#1b1f24", "#e69f00", "#56b4e9", "#7a5b00"};
  return kColours[index % kColours.size()];
}

std::string chart_group(const Chart& chart, double at_x, double at_y) {
  const PlotRange across = chart.x_range.value_or(range_over(chart, true));
  const PlotRange up = chart.y_range.value_or(range_over(chart, false));
  const double left = chart.y_names.empty() ? kLeft : kLeftOfNames;
  const double width = chart.width - left - kRight;
  const double height = chart.height - kTop - kBottom;
  const auto x_of = [&](double x) { return left + (x - across.low) / across.span() * width; };
  const auto y_of = [&](double y) { return kTop + (up.high - y) / up.span() * height; };
  std::string text = fmt::format("<g transform=\"translate({:g} {:g})\">\n", at_x, at_y);
  auto out = std::back_inserter(text);
  for (const Tick& tick : ticks(across, chart.width < 400.0 ? 4 : 7)) {
    fmt::format_to(
        out,
        "<path class=\"g\" d=\"M{:.1f} {:g}v{:.1f}\"/><text x=\"{:.1f}\" y=\"{:.1f}\" "
        "text-anchor=\"middle\">{}</text>\n",
        x_of(tick.value), kTop, height, x_of(tick.value), kTop + height + 14.0,
        chart.logarithmic_x ? fmt::format("{:.3g}", std::pow(10.0, tick.value)) : tick.text);
  }
  std::vector<std::pair<double, std::string>> names = chart.y_names;
  if (names.empty()) {
    for (const Tick& tick : ticks(up, 5)) names.emplace_back(tick.value, tick.text);
  }
  for (const auto& [value, name] : names) {
    fmt::format_to(out,
                   "<path class=\"g\" d=\"M{:g} {:.1f}h{:.1f}\"/><text x=\"{:g}\" y=\"{:.1f}\" "
                   "text-anchor=\"end\">{}</text>\n",
                   left, y_of(value), width, left - 5.0, y_of(value) + 4.0, escaped(name));
  }
  for (const ChartLine& line : chart.lines) {
    std::string path;
    bool gap = true;
    std::pair<double, double> last{-1e9, -1e9};
    for (const std::size_t k : kept(line.y)) {
      if (!std::isfinite(line.x[k]) || !std::isfinite(line.y[k])) {
        gap = true;
        continue;
      }
      // What lies outside is drawn at the rim's height, just beyond it.
      const double x = std::clamp(x_of(line.x[k]), left - 1e4, left + width + 1e4);
      const double y = std::clamp(y_of(line.y[k]), kTop - 1e4, kTop + height + 1e4);
      if (line.dots) {
        if (x < left - 1.0 || x > left + width + 1.0 || y < kTop - 1.0 || y > kTop + height + 1.0)
          continue;
        fmt::format_to(out, "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3\" fill=\"{}\"/>\n", x, y,
                       line.colour);
        continue;
      }
      if (!gap && std::abs(x - last.first) + std::abs(y - last.second) < 0.3) continue;
      last = {x, y};
      fmt::format_to(std::back_inserter(path), "{}{:.1f} {:.1f}", gap ? "M" : "L", x, y);
      gap = false;
    }
    if (path.empty()) continue;
    // The nested picture cuts off what lies outside of the frame.
    fmt::format_to(out,
                   "<svg x=\"{0:g}\" y=\"{1:g}\" width=\"{2:.1f}\" height=\"{3:.1f}\" "
                   "viewBox=\"{0:g} {1:g} {2:.1f} {3:.1f}\"><path class=\"l\" stroke=\"{4}\"{5} "
                   "d=\"{6}\"/></svg>\n",
                   left, kTop, width, height, line.colour,
                   line.dashed ? " stroke-dasharray=\"5 3\"" : "", path);
  }
  fmt::format_to(out,
                 "<rect class=\"f\" x=\"{0:g}\" y=\"{1:g}\" width=\"{2:.1f}\" height=\"{3:.1f}\"/>"
                 "<text class=\"h\" x=\"{0:g}\" y=\"{4:g}\">{5}</text>"
                 "<text x=\"{6:g}\" y=\"{4:g}\" text-anchor=\"end\">{7}</text>"
                 "<text x=\"{6:g}\" y=\"{8:.1f}\" text-anchor=\"end\">{9}</text>\n",
                 left, kTop, width, height, kTop - 9.0, escaped(chart.title), left + width,
                 escaped(chart.y_label), kTop + height + 28.0, escaped(chart.x_label));
  Chart below = chart;
  below.height = chart.height + kLegendLine - 4.0;
  return text + legend(below) + "</g>\n";
}

std::string chart_svg(const Chart& chart) {
  return fmt::format(
             "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0:g} {1:g}\" role=\"img\" "
             "width=\"{0:g}\" height=\"{1:g}\"><title>{2}</title>\n{3}"
             "<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n",
             chart.width, whole_height(chart), escaped(chart.title), kStyle) +
         chart_group(chart) + "</svg>\n";
}

std::string chart_sheet(const std::string& title, const std::vector<Chart>& charts,
                        std::size_t columns) {
  if (charts.empty()) return {};
  double cell = 0.0;
  for (const Chart& chart : charts) cell = std::max(cell, whole_height(chart));
  const double width = charts.front().width * static_cast<double>(columns);
  const std::size_t rows = (charts.size() + columns - 1) / columns;
  constexpr double kTitle = 26.0;
  std::string text = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0:g} {1:g}\" role=\"img\" "
      "width=\"{0:g}\" height=\"{1:g}\"><title>{2}</title>\n{3}"
      "<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n"
      "<text class=\"h\" x=\"{4:g}\" y=\"18\">{2}</text>\n",
      width, kTitle + cell * static_cast<double>(rows), escaped(title), kStyle, kLeft);
  for (std::size_t i = 0; i < charts.size(); ++i) {
    text += chart_group(charts[i], charts[i].width * static_cast<double>(i % columns),
                        kTitle + cell * static_cast<double>(i / columns));
  }
  return text + "</svg>\n";
}

std::string html_page(const std::string& title, const std::string& body) {
  return fmt::format(
      "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width\"><title>{0}</title><style>"
      "body{{font:15px/1.5 system-ui,sans-serif;margin:1.5rem auto;max-width:1180px;padding:0 1rem;"
      "color:#1b1f24;background:#fff}}h1{{font-size:1.4rem}}h2{{font-size:1.1rem;margin-top:2rem}}"
      "table{{border-collapse:collapse;font-size:.875rem}}th,td{{padding:.25rem .75rem;text-align:"
      "right;border-bottom:1px solid #e7eaee;font-variant-numeric:tabular-nums}}"
      "th:first-child,td:first-child{{text-align:left;padding-left:0}}th{{color:#5b6570;font-"
      "weight:"
      "500}}td.best{{font-weight:600}}td.no{{color:#b23a00}}svg{{max-width:100%;height:auto}}"
      ".note{{color:#5b6570}}</style><h1>{0}</h1>\n{1}</html>\n",
      escaped(title), body);
}

std::vector<double> time_axis(std::size_t count, double sample_time_s) {
  std::vector<double> axis;
  axis.reserve(count);
  for (std::size_t k = 0; k < count; ++k) axis.push_back(static_cast<double>(k) * sample_time_s);
  return axis;
}

}  // namespace loopwarden::workbench
