// SPDX-License-Identifier: Apache-2.0
// A curve by points, joined by lines; at both ends it goes on with its last slope.
//
// Errors: no exceptions; `count` points of 2 or more, the first of each rising.
#pragma once

#include <array>
#include <cstddef>
#include <utility>

namespace loopwarden::plant {

template <std::size_t kMost>
double on_lines(const std::array<std::pair<double, double>, kMost>& points, std::size_t count,
                double x) noexcept {
  std::size_t right = 1;
  while (right + 1 < count && x > points[right].first) ++right;
  const auto& [x0, y0] = points[right - 1];
  const auto& [x1, y1] = points[right];
  return y0 + (y1 - y0) * (x - x0) / (x1 - x0);
}

}  // namespace loopwarden::plant
