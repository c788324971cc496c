// SPDX-License-Identifier: Apache-2.0
// The chart kit: a chart with axes, grid and a legend as SVG, several on one sheet, and the frame of an HTML page
// around them. Every picture of the programs is made of it, in the colours of palette.hpp.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "workbench/report/palette.hpp"
#include "workbench/report/plot.hpp"

namespace loopwarden::workbench {

struct ChartLine {
  std::string name;  // empty: not in the legend
  std::string colour = palette::kBlue;
  std::vector<double> x{}, y{};  // of one length; NaN: a gap
  bool dashed = false;
  bool dots = false;  // points instead of a line
};

// A stretch of x over the full height.
struct ChartBand {
  double from = 0.0;
  double to = 0.0;
  std::string colour = palette::kOrange;
  double opacity = 0.1;
  std::string meaning{};
};

struct Chart {
  std::string title;
  std::string x_label;
  std::string y_label;
  std::vector<ChartLine> lines{};
  double width = 560.0;
  double height = 260.0;
  std::optional<PlotRange> x_range{}, y_range{};  // else what the lines cover
  bool logarithmic_x = false;                     // x are then their decimal logarithms
  bool logarithmic_y = false;
  // Instead of numbers at the axis.
  std::vector<std::pair<double, std::string>> x_names{}, y_names{};
  std::vector<ChartBand> bands{};
  std::vector<double> levels{};  // dotted lines across
};

// `at_x`, `at_y`: where the chart stands in a larger picture.
std::string chart_group(const Chart& chart, double at_x = 0.0, double at_y = 0.0);
// With its legend.
double chart_height(const Chart& chart);
// A picture of its own.
std::string chart_svg(const Chart& chart);
// A larger picture of groups, with a title above them; `kSheetTitle` of its height are the title's.
inline constexpr double kSheetTitle = 26.0;
std::string sheet_svg(const std::string& title, double width, double height,
                      const std::string& groups);
// Charts in rows of `columns` under one title; all of one width.
std::string chart_sheet(const std::string& title, const std::vector<Chart>& charts,
                        std::size_t columns);
// A self-contained page.
std::string html_page(const std::string& title, const std::string& body);

// k h for k = 0 to count - 1, s.
std::vector<double> time_axis(std::size_t count, double sample_time_s);

}  // namespace loopwarden::workbench
