// SPDX-License-Identifier: Apache-2.0
// Basic functions for pictures of records: ranges, ticks, point reduction, escaped text.
//
// Curves are drawn in whole numbers: x is the sample, y runs from 0 at the top of the range to
// kPlotHeight at its bottom. That keeps files small, and a page can read the values back.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace loopwarden::workbench {

inline constexpr double kPlotHeight = 10000.0;

struct PlotRange {
  double low = 0.0;
  double high = 1.0;  // > low

  double span() const noexcept { return high - low; }
  // Returns the height of a value below the top of the range, 0 to kPlotHeight.
  double down(double value) const noexcept { return (high - value) / span() * kPlotHeight; }
};

// Returns the range of all finite values of all columns, extended by `margin` of its span at both
// ends. Returns 0 to 1 without finite values. The range around a constant is not empty.
PlotRange range_of(std::span<const std::span<const double>> columns, double margin);

struct Tick {
  double value;
  std::string text;
};
// Returns about `count` round numbers within the range.
std::vector<Tick> ticks(const PlotRange& range, int count);

struct PlotPoint {
  std::int64_t x;  // sample
  std::int64_t y;
  bool starts;  // start of a new piece of the curve, after missing values

  friend bool operator==(const PlotPoint&, const PlotPoint&) = default;
};

// Reduces a curve to the least and the greatest value in each of `columns` stretches of samples,
// which keeps all peaks. NaN and infinities are gaps. Points on the straight line between their
// neighbours are left out.
std::vector<PlotPoint> decimated(std::span<const double> values, const PlotRange& range,
                                 std::size_t columns);
// Reduces a curve within `tolerance` (Ramer 1972; Douglas and Peucker 1973).
std::vector<PlotPoint> simplified(std::span<const PlotPoint> points, double tolerance);
// Returns the data of an SVG path: "M x y" for each piece, then relative steps between points.
std::string path_data(std::span<const PlotPoint> points);

// Returns a number with four digits, or "-" if it is not finite.
std::string plain_number(double value);
// Escapes text for HTML, SVG and their attributes. Characters that neither allows are replaced.
std::string escaped(std::string_view text);

}  // namespace loopwarden::workbench
