// SPDX-License-Identifier: Apache-2.0
// CO that planned moves hold, and the time since it has arrived there.
#pragma once

#include <algorithm>

#include "model/control/output_limiter.hpp"

namespace loopwarden::control {

struct HeldOutput {
  double output = 0.0;  // CO units
  double held_s = 0.0;  // since CO has arrived; 0 while a ramp is under way

  // Holds `wanted`, CO units, within the limits.
  void hold(double wanted, const OutputLimits& limits) noexcept {
    output = std::clamp(wanted, limits.low, limits.high);
  }
  void pass(bool arrived, double period_s) noexcept { held_s = arrived ? held_s + period_s : 0.0; }
};

}  // namespace loopwarden::control
