// SPDX-License-Identifier: Apache-2.0
#include "workbench/report/chart.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <span>

#include "workbench/report/assets.hpp"

namespace loopwarden::workbench {
namespace {

constexpr double kLeft = 52.0;
constexpr double kLeftOfNames = 92.0;
constexpr double kRight = 10.0;
constexpr double kTop = 26.0;
constexpr double kBottom = 34.0;
constexpr double kLegendLine = 15.0;
constexpr std::size_t kMostPoints = 1400;  // of a line; the least and the greatest of more

// Paths use tenths of the picture's unit. Points within kTolerance of the drawn line are dropped.
constexpr double kTenths = 10.0;
constexpr double kTolerance = 2.0;

std::string style() {
  return fmt::format(
      "<style>text{{font:11px system-ui,sans-serif;fill:{}}}text.t{{fill:{}}}"
      "text.h{{fill:{};font-weight:600;font-size:12px}}.l{{fill:none;stroke-width:1.5;"
      "stroke-linejoin:round;vector-effect:non-scaling-stroke}}.g{{stroke:{}}}"
      ".f{{fill:none;stroke:{}}}.v{{stroke:{};stroke-dasharray:2 4}}</style>\n",
      palette::kSoft, palette::kInk, palette::kInk, palette::kGrid, palette::kFrame,
      palette::kSoft);
}

// Returns the text of a tick at a logarithmic axis.
std::string power_text(double logarithm) {
  return fmt::format("{:.3g}", std::pow(10.0, logarithm));
}

PlotRange range_over(const Chart& chart, bool across) {
  std::vector<std::span<const double>> columns;
  for (const ChartLine& line : chart.lines) columns.emplace_back(across ? line.x : line.y);
  for (const ChartArea& area : chart.areas) {
    columns.emplace_back(across ? area.x : area.low);
    if (!across) columns.emplace_back(area.high);
  }
  return range_of(columns, across ? 0.0 : 0.06);
}

// Returns the indices of the least and the greatest sample of each stretch, in order. Keeps all
// samples if x is not time.
std::vector<std::size_t> kept(const ChartLine& line) {
  const std::vector<double>& y = line.y;
  std::vector<std::size_t> indices;
  const std::size_t n = y.size();
  if (n <= kMostPoints || !std::is_sorted(line.x.begin(), line.x.end())) {
    for (std::size_t k = 0; k < n; ++k) indices.push_back(k);
    return indices;
  }
  const std::size_t buckets = kMostPoints / 2;
  for (std::size_t b = 0; b < buckets; ++b) {
    const std::size_t from = b * n / buckets;
    const std::size_t to = (b + 1) * n / buckets;
    std::size_t least = to;
    std::size_t most = to;
    for (std::size_t k = from; k < to; ++k) {
      if (!std::isfinite(y[k])) continue;
      if (least == to || y[k] < y[least]) least = k;
      if (most == to || y[k] > y[most]) most = k;
    }
    // The stretch is only a gap.
    const std::size_t first = least == to ? from : std::min(least, most);
    const std::size_t last = least == to ? from : std::max(least, most);
    indices.push_back(first);
    if (last != first) indices.push_back(last);
  }
  return indices;
}

struct Legend {
  std::string text;
  std::size_t lines = 0;
};

// `first_y`: position of the first line of the legend.
Legend legend(const Chart& chart, double first_y) {
  Legend made;
  double at = kLeft;
  for (const ChartLine& line : chart.lines) {
    if (line.name.empty()) continue;
    const double needs = 30.0 + 6.2 * static_cast<double>(line.name.size());
    if (made.lines == 0) made.lines = 1;
    if (at + needs > chart.width && at > kLeft) {
      at = kLeft;
      ++made.lines;
    }
    const double y = first_y + kLegendLine * static_cast<double>(made.lines - 1);
    fmt::format_to(std::back_inserter(made.text),
                   "<path class=\"l\" stroke=\"{}\"{} d=\"M{:.0f} {:.0f}h16\"/><text x=\"{:.0f}\" "
                   "y=\"{:.0f}\">{}</text>\n",
                   line.colour, line.dashed ? " stroke-dasharray=\"5 3\"" : "", at, y - 4.0,
                   at + 20.0, y, escaped(line.name));
    at += needs;
  }
  return made;
}

using Names = std::vector<std::pair<double, std::string>>;

// Returns the texts at an axis: the chart's own names, otherwise numbers.
Names names_at(const Names& given, const PlotRange& range, int count, bool logarithmic) {
  if (!given.empty()) return given;
  Names names;
  for (const Tick& tick : ticks(range, count)) {
    names.emplace_back(tick.value, logarithmic ? power_text(tick.value) : tick.text);
  }
  return names;
}

std::string svg(const std::string& title, double width, double height, const std::string& content) {
  return fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0:g} {1:g}\" role=\"img\" "
      "width=\"{0:g}\" height=\"{1:g}\"><title>{2}</title>\n{3}"
      "<rect width=\"100%\" height=\"100%\" fill=\"{4}\"/>\n{5}</svg>\n",
      width, height, escaped(title), style(), palette::kPaper, content);
}

}  // namespace

double chart_height(const Chart& chart) {
  return chart.height + kLegendLine * static_cast<double>(legend(chart, 0.0).lines);
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
  for (const ChartBand& band : chart.bands) {
    const double from = x_of(std::clamp(band.from, across.low, across.high));
    const double to = x_of(std::clamp(band.to, across.low, across.high));
    fmt::format_to(out,
                   "<rect fill=\"{}\" fill-opacity=\"{:.2f}\" x=\"{:.1f}\" y=\"{:g}\" "
                   "width=\"{:.1f}\" height=\"{:.1f}\">{}</rect>\n",
                   band.colour, band.opacity, from, kTop, std::max(0.0, to - from), height,
                   band.meaning.empty() ? "" : "<title>" + escaped(band.meaning) + "</title>");
  }
  for (const auto& [value, name] :
       names_at(chart.x_names, across, chart.width < 400.0 ? 4 : 7, chart.logarithmic_x)) {
    fmt::format_to(out,
                   "<path class=\"g\" d=\"M{:.1f} {:g}v{:.1f}\"/><text x=\"{:.1f}\" y=\"{:.1f}\" "
                   "text-anchor=\"middle\">{}</text>\n",
                   x_of(value), kTop, height, x_of(value), kTop + height + 14.0, escaped(name));
  }
  for (const auto& [value, name] :
       names_at(chart.y_names, up, height < 100.0 ? 4 : 5, chart.logarithmic_y)) {
    fmt::format_to(out,
                   "<path class=\"g\" d=\"M{:g} {:.1f}h{:.1f}\"/><text x=\"{:g}\" y=\"{:.1f}\" "
                   "text-anchor=\"end\">{}</text>\n",
                   left, y_of(value), width, left - 5.0, y_of(value) + 4.0, escaped(name));
  }
  for (const double level : chart.levels) {
    if (level < up.low || level > up.high) continue;
    fmt::format_to(out, "<path class=\"v\" d=\"M{:g} {:.1f}h{:.1f}\"/>\n", left, y_of(level),
                   width);
  }
  for (const ChartArea& area : chart.areas) {
    std::string points;
    const auto add = [&](std::size_t k, const std::vector<double>& y) {
      points += fmt::format("{:.1f} {:.1f} ", x_of(area.x[k]), y_of(y[k]));
    };
    for (std::size_t k = 0; k < area.x.size(); ++k) add(k, area.high);
    for (std::size_t k = area.x.size(); k-- > 0;) add(k, area.low);
    fmt::format_to(out, "<polygon fill=\"{}\" fill-opacity=\"0.2\" points=\"{}\"/>\n", area.colour,
                   points);
  }
  for (const ChartLine& line : chart.lines) {
    std::vector<PlotPoint> points;
    bool gap = true;
    for (const std::size_t k : kept(line)) {
      if (!std::isfinite(line.x[k]) || !std::isfinite(line.y[k])) {
        gap = true;
        continue;
      }
      // Points outside are clamped to a short distance beyond the frame.
      const double x = std::clamp(x_of(line.x[k]), left - 1e4, left + width + 1e4);
      const double y = std::clamp(y_of(line.y[k]), kTop - 1e4, kTop + height + 1e4);
      if (line.dots) {
        if (x < left - 1.0 || x > left + width + 1.0 || y < kTop - 1.0 || y > kTop + height + 1.0)
          continue;
        fmt::format_to(out, "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3\" fill=\"{}\"/>\n", x, y,
                       line.colour);
        continue;
      }
      points.push_back(
          {std::llround((x - left) * kTenths), std::llround((y - kTop) * kTenths), gap});
      gap = false;
    }
    if (points.empty()) continue;
    // The nested picture clips the line at the frame.
    fmt::format_to(out,
                   "<svg x=\"{:g}\" y=\"{:g}\" width=\"{:.1f}\" height=\"{:.1f}\" "
                   "viewBox=\"0 0 {:.0f} {:.0f}\" preserveAspectRatio=\"none\"><path class=\"l\" "
                   "stroke=\"{}\"{} d=\"{}\"/></svg>\n",
                   left, kTop, width, height, width * kTenths, height * kTenths, line.colour,
                   line.dashed ? " stroke-dasharray=\"5 3\"" : "",
                   path_data(simplified(points, kTolerance)));
  }
  fmt::format_to(out,
                 "<rect class=\"f\" x=\"{0:g}\" y=\"{1:g}\" width=\"{2:.1f}\" height=\"{3:.1f}\"/>"
                 "<text class=\"h\" x=\"{0:g}\" y=\"{4:g}\">{5}</text>"
                 "<text x=\"{6:g}\" y=\"{4:g}\" text-anchor=\"end\">{7}</text>"
                 "<text x=\"{6:g}\" y=\"{8:.1f}\" text-anchor=\"end\">{9}</text>\n",
                 left, kTop, width, height, kTop - 9.0, escaped(chart.title), left + width,
                 escaped(chart.y_label), kTop + height + 28.0, escaped(chart.x_label));
  return text + legend(chart, chart.height + kLegendLine - 8.0).text + "</g>\n";
}

std::string sheet_svg(const std::string& title, double width, double height,
                      const std::string& groups) {
  if (title.empty()) return svg(title, width, height, groups);
  return svg(
      title, width, height,
      fmt::format("<text class=\"h\" x=\"{:g}\" y=\"18\">{}</text>\n", kLeft, escaped(title)) +
          groups);
}

std::string chart_svg(const Chart& chart) {
  return svg(chart.title, chart.width, chart_height(chart), chart_group(chart));
}

std::string chart_sheet(const std::string& title, const std::vector<Chart>& charts,
                        std::size_t columns) {
  if (charts.empty()) return {};
  std::string groups;
  double top = kSheetTitle;
  for (std::size_t first = 0; first < charts.size(); first += columns) {
    double row = 0.0;
    for (std::size_t i = first; i < std::min(first + columns, charts.size()); ++i) {
      groups += chart_group(charts[i], charts[i].width * static_cast<double>(i - first), top);
      row = std::max(row, chart_height(charts[i]));
    }
    top += row;
  }
  return sheet_svg(title, charts.front().width * static_cast<double>(columns), top, groups);
}

std::string html_page(const std::string& title, const std::string& body) {
  return fmt::format(
      "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width, initial-scale=1\"><title>{0}</title><style>{1}{2}</style>"
      "<h1>{0}</h1>\n{3}</html>\n",
      escaped(title), palette_style(), kPageStyle, body);
}

std::vector<double> time_axis(std::size_t count, double sample_time_s) {
  std::vector<double> axis;
  axis.reserve(count);
  for (std::size_t k = 0; k < count; ++k) axis.push_back(static_cast<double>(k) * sample_time_s);
  return axis;
}

}  // namespace loopwarden::workbench
