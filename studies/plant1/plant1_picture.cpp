// SPDX-License-Identifier: Apache-2.0
// One measured record of plant 1 as a picture: measured, published and corrected, residual below.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <span>

#include "studies/plant1/plant1_study.hpp"
#include "workbench/report/plot.hpp"

namespace loopwarden::studies {
namespace {

constexpr double kWidth = 920.0;
constexpr double kHeight = 430.0;
constexpr double kLeftMargin = 48.0;
constexpr double kRightMargin = 14.0;
constexpr int kMostColumns = 480;  // a point for every second sample

struct Panel {
  double top;
  double height;
  workbench::PlotRange range;  // L/min
  double seconds;              // along the panel

  double x(double time_s) const {
    return kLeftMargin + time_s / seconds * (kWidth - kLeftMargin - kRightMargin);
  }
  double y(double value) const { return top + (range.high - value) / range.span() * height; }
};

std::string frame(const Panel& panel, int values) {
  std::string svg;
  auto out = std::back_inserter(svg);
  for (const workbench::Tick& tick : workbench::ticks(panel.range, values)) {
    fmt::format_to(out,
                   "<line class=\"grid\" x1=\"{:.1f}\" x2=\"{:.1f}\" y1=\"{:.1f}\" y2=\"{:.1f}\"/>"
                   "<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"end\">{}</text>\n",
                   kLeftMargin, kWidth - kRightMargin, panel.y(tick.value), panel.y(tick.value),
                   kLeftMargin - 6.0, panel.y(tick.value) + 4.0, tick.text);
  }
  return svg;
}

std::string curve(const Panel& panel, std::span<const double> values, const char* kind) {
  const std::size_t stride = std::max<std::size_t>(1, values.size() / kMostColumns);
  std::string points;
  for (std::size_t k = 0; k < values.size(); k += stride) {
    const double value = std::clamp(values[k], panel.range.low, panel.range.high);
    fmt::format_to(std::back_inserter(points), "{:.1f},{:.1f} ",
                   panel.x(static_cast<double>(k) * kPlant1PeriodS), panel.y(value));
  }
  return fmt::format("<polyline class=\"{}\" points=\"{}\"/>\n", kind, points);
}

}  // namespace

std::string plant1_picture(const Plant1Outcome& row) {
  const Plant1Record& record = row.record;
  const double seconds = static_cast<double>(record.pv.size()) * kPlant1PeriodS;
  std::vector<double> residual(record.pv.size());
  for (std::size_t k = 0; k < residual.size(); ++k)
    residual[k] = record.pv[k] - row.corrected_pv[k];

  const std::span<const double> flows[] = {record.pv, row.published_pv, row.corrected_pv};
  const Panel flow{
      .top = 40.0, .height = 250.0, .range = workbench::range_of(flows, 0.03), .seconds = seconds};
  const Panel rest{
      .top = 318.0, .height = 80.0, .range = {.low = -1.5, .high = 1.5}, .seconds = seconds};

  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0:g} {1:g}\" width=\"{0:g}\" "
      "height=\"{1:g}\">\n<style>text{{font:12px sans-serif;fill:#333}}.grid{{stroke:#e4e4e4}}"
      "polyline{{fill:none;stroke-width:1.6}}.measured{{stroke:#222}}.published{{stroke:#bbb;"
      "stroke-width:1.3}}.corrected{{stroke:#d1495b}}.residual{{stroke:#2a6f97;stroke-width:1.2}}"
      "</style>\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n",
      kWidth, kHeight);
  svg += fmt::format(
      "<text x=\"{:g}\" y=\"20\" style=\"font-weight:bold\">{} ({})</text>"
      "<text x=\"{:g}\" y=\"20\"><tspan fill=\"#222\">&#9632; measured</tspan>"
      "<tspan dx=\"14\" fill=\"#999\">&#9632; published model, fit {:.1f} %</tspan>"
      "<tspan dx=\"14\" fill=\"#d1495b\">&#9632; corrected model, fit {:.1f} %</tspan></text>\n",
      kLeftMargin, workbench::escaped(record.name), workbench::escaped(record.condition),
      kLeftMargin + 220.0, fit_percent(row.published_misfit), fit_percent(row.corrected_misfit));
  svg += frame(flow, 6) + frame(rest, 3);
  for (const workbench::Tick& tick : workbench::ticks({.low = 0.0, .high = seconds}, 10)) {
    svg += fmt::format("<text x=\"{:.1f}\" y=\"{:g}\" text-anchor=\"middle\">{}</text>\n",
                       flow.x(tick.value), kHeight - 14.0, tick.text);
  }
  svg += curve(flow, row.published_pv, "published") + curve(flow, record.pv, "measured") +
         curve(flow, row.corrected_pv, "corrected") + curve(rest, residual, "residual");
  svg += fmt::format(
      "<text x=\"{:g}\" y=\"{:g}\">PV, L/min</text>"
      "<text x=\"{:g}\" y=\"{:g}\">measured - corrected, L/min</text>"
      "<text x=\"{:g}\" y=\"{:g}\" text-anchor=\"end\">s</text>\n</svg>\n",
      kLeftMargin + 4.0, flow.top + 12.0, kLeftMargin + 4.0, rest.top + 10.0, kWidth - kRightMargin,
      kHeight - 2.0);
  return svg;
}

}  // namespace loopwarden::studies
