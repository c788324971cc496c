// SPDX-License-Identifier: Apache-2.0
// The ends of the travel of a stem. A stem that reaches an end stops there.
//
//   low, high  CO units; infinite if the travel has no end
#pragma once

#include <limits>

namespace loopwarden::effects {

struct Travel {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();

  bool beyond(double x) const noexcept { return x > high || x < low; }
  // Returns `x` clamped to the ends.
  double within(double x) const noexcept { return x > high ? high : x < low ? low : x; }
};

}  // namespace loopwarden::effects
