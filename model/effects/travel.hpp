// SPDX-License-Identifier: Apache-2.0
// The ends of a stem's travel: what runs into one stands there, at rest.
//
//   low, high  CO units; infinite where the travel has no end
#pragma once

#include <limits>

namespace loopwarden::effects {

struct Travel {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();

  bool beyond(double x) const noexcept { return x > high || x < low; }
  // The end that `x` lies beyond, else `x`.
  double within(double x) const noexcept { return x > high ? high : x < low ? low : x; }
};

}  // namespace loopwarden::effects
