// SPDX-License-Identifier: Apache-2.0
// Stiction, simplified data-driven law (effect `stiction`, law `he`).
//
//   r = u - x                          force not yet balanced, CO units
//   |r| > fs:  x = u - sign(r) fd      slips, and sticks again in the same sample
//   else       x stays
//
//   u  CO units in     x  CO units out     fs, fd  CO units, see stiction_law.hpp
//
// The stem sticks again after every sample, so that even steady motion is a series of small slips.
//
// Errors: none. A non-finite u leaves the stem where it is.
// What it can't do: continuous motion (it overstates stick-slip on ramps); the rest as for the
// Choudhury law.
//
// Source: He, Wang, Pottmann and Qin, Ind. Eng. Chem. Res. 46 (2007) 4549-4560.
#pragma once

#include <cmath>

#include "model/plant/stiction_law.hpp"

namespace loopwarden::plant {

class StictionHe {
 public:
  explicit StictionHe(StictionParameters parameters) noexcept : full_(parameters) {
    set_severity(1.0);
  }

  void set_severity(double severity) noexcept {
    const StictionParameters now{full_.s * severity, full_.j * severity};
    static_friction_ = now.static_friction();
    moving_friction_ = now.moving_friction();
  }

  double reset(double u) noexcept { return x_ = u; }

  double step(double u) noexcept {
    const double r = u - x_;
    if (std::abs(r) > static_friction_ && std::isfinite(u))
      x_ = u - std::copysign(moving_friction_, r);
    return x_;
  }

 private:
  StictionParameters full_;
  double static_friction_ = 0.0;  // CO units
  double moving_friction_ = 0.0;  // CO units
  double x_ = 0.0;                // CO units
};

}  // namespace loopwarden::plant
