// SPDX-License-Identifier: Apache-2.0
// A chart with axes, grid and a legend as SVG, and the frame of an HTML page around several.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "workbench/report/plot.hpp"

namespace loopwarden::workbench {

struct ChartLine {
  std::string name;  // empty: not in the legend
  std::string colour = "#0072b2";
  std::vector<double> x{}, y{};  // of one length; NaN: a gap
  bool dashed = false;
  bool dots = false;  // points instead of a line
};

struct Chart {
  std::string title;
  std::string x_label;
  std::string y_label;
  std::vector<ChartLine> lines{};
  double width = 560.0;
  double height = 260.0;
  std::optional<PlotRange> x_range{}, y_range{};          // else what the lines cover
  bool logarithmic_x = false;                             // x are then their decimal logarithms
  std::vector<std::pair<double, std::string>> y_names{};  // instead of numbers at the axis
};

// Colours for lines side by side, told apart by people with any colour vision (Okabe and Ito 2008).
const char* chart_colour(std::size_t index);

// `at_x`, `at_y`: where the chart stands in a larger picture.
std::string chart_group(const Chart& chart, double at_x = 0.0, double at_y = 0.0);
// A picture of its own.
std::string chart_svg(const Chart& chart);
// Charts in rows of `columns` under one title; all of one size.
std::string chart_sheet(const std::string& title, const std::vector<Chart>& charts,
                        std::size_t columns);
// A self-contained page.
std::string html_page(const std::string& title, const std::string& body);

// k h for k = 0 to count - 1, s.
std::vector<double> time_axis(std::size_t count, double sample_time_s);

}  // namespace loopwarden::workbench
