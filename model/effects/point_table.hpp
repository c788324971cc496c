// SPDX-License-Identifier: Apache-2.0
// Returns the value at `x` of a curve that is linear between points and continues with its end
// slopes.
//
// `count` >= 2; the first coordinate of the points rises.
// Errors: no exceptions.
#pragma once

#include <array>
#include <cstddef>
#include <utility>

namespace loopwarden::effects {

template <std::size_t kMost>
double on_lines(const std::array<std::pair<double, double>, kMost>& points, std::size_t count,
                double x) noexcept {
  std::size_t right = 1;
  while (right + 1 < count && x > points[right].first) ++right;
  const auto& [x0, y0] = points[right - 1];
  const auto& [x1, y1] = points[right];
  return y0 + (y1 - y0) * (x - x0) / (x1 - x0);
}

}  // namespace loopwarden::effects
