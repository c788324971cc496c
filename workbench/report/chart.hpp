// SPDX-License-Identifier: Apache-2.0
// Draws charts as SVG with axes, grid and legend, several on one sheet, and the frame of an HTML
// page. All pictures of the programs use these functions and the colours of palette.hpp.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "workbench/report/palette.hpp"
#include "workbench/report/plot.hpp"

namespace loopwarden::workbench {

struct ChartLine {
  std::string name;  // empty: no entry in the legend
  std::string colour = palette::kBlue;
  std::vector<double> x{}, y{};  // equal lengths; NaN: a gap
  bool dashed = false;
  bool dots = false;  // points instead of a line
};

// The area between two lines, shaded.
struct ChartArea {
  std::string colour = palette::kBlue;
  std::vector<double> x{}, low{}, high{};  // equal lengths, finite
};

// A stretch of x that is shaded over the full height.
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
  std::optional<PlotRange> x_range{}, y_range{};  // empty: the range of the lines
  bool logarithmic_x = false;                     // x then holds decimal logarithms
  bool logarithmic_y = false;
  // Names at the axis in place of numbers.
  std::vector<std::pair<double, std::string>> x_names{}, y_names{};
  std::vector<ChartBand> bands{};
  std::vector<ChartArea> areas{};
  std::vector<double> levels{};  // dotted horizontal lines
};

// Returns a chart as a group of a larger picture. `at_x`, `at_y`: its position there.
std::string chart_group(const Chart& chart, double at_x = 0.0, double at_y = 0.0);
// Returns the height of the chart with its legend.
double chart_height(const Chart& chart);
// Returns the chart as a separate picture.
std::string chart_svg(const Chart& chart);
// Height of the title that sheet_svg draws above the groups.
inline constexpr double kSheetTitle = 26.0;
std::string sheet_svg(const std::string& title, double width, double height,
                      const std::string& groups);
// Returns charts of equal width in rows of `columns` under one title.
std::string chart_sheet(const std::string& title, const std::vector<Chart>& charts,
                        std::size_t columns);
// Returns a self-contained page.
std::string html_page(const std::string& title, const std::string& body);

// Returns k h for k = 0 to count - 1, in s.
std::vector<double> time_axis(std::size_t count, double sample_time_s);

}  // namespace loopwarden::workbench
