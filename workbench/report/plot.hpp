// SPDX-License-Identifier: Apache-2.0
// What every picture of a record needs: ranges, ticks, few points for many samples, safe text.
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
  // Height of a value below the top of the range, as above.
  double down(double value) const noexcept { return (high - value) / span() * kPlotHeight; }
};

// All finite values of all columns, and `margin` of their span more at both ends. 0 to 1 if there
// are none; a constant gets room around it.
PlotRange range_of(std::span<const std::span<const double>> columns, double margin);

struct Tick {
  double value;
  std::string text;
};
// About `count` round numbers within the range.
std::vector<Tick> ticks(const PlotRange& range, int count);

struct PlotPoint {
  std::int64_t x;  // sample
  std::int64_t y;
  bool starts;  // a new piece of the curve: what lies before it is missing

  friend bool operator==(const PlotPoint&, const PlotPoint&) = default;
};

// A curve in at most two points for each of `columns` stretches of samples, the least and the
// greatest value of each, so that no peak is lost. NaN and infinities are gaps. What lies on the
// straight line between its neighbours is left out.
std::vector<PlotPoint> decimated(std::span<const double> values, const PlotRange& range,
                                 std::size_t columns);
// The same curve within `tolerance`, in fewer points (Ramer 1972; Douglas and Peucker 1973).
std::vector<PlotPoint> simplified(std::span<const PlotPoint> points, double tolerance);
// The data of an SVG path: "M x y" for each piece, then steps from point to point.
std::string path_data(std::span<const PlotPoint> points);

// For people: four digits, "-" for what is not finite.
std::string plain_number(double value);
// Text for HTML, SVG and their attributes. Characters that neither may hold are replaced.
std::string escaped(std::string_view text);

}  // namespace loopwarden::workbench
