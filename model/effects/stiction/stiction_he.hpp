// SPDX-License-Identifier: Apache-2.0
// Stiction: a simplified data-driven law (effect `stiction`, law `he`).
//
//   r = u - x                          force not yet balanced, CO units
//   |r| > fs:  x = u - sign(r) fd      slips, and sticks again in the same sample
//   otherwise  x stays
//
//   u  CO units in     x  CO units out     fs, fd  CO units, see stiction_law.hpp
//
// The stem sticks again after every sample, so that even steady motion is a series of small slips.
//
// Errors: no exceptions. If u is not finite, the stem keeps its position.
// Limits: no continuous motion, so it overstates stick-slip on ramps; otherwise those of the
// Choudhury law.
//
// Source: He, Wang, Pottmann and Qin, Ind. Eng. Chem. Res. 46 (2007) 4549-4560.
#pragma once

#include <cmath>

#include "model/numeric/lanes.hpp"
#include "model/effects/stiction/stiction_law.hpp"

namespace loopwarden::effects {

// The equation for one stem or for several stems in parallel (numeric/lanes.hpp).
template <class N>
struct HeLaw {
  N static_friction;
  N moving_friction;
  N x;
  N step(N u) noexcept {
    const N r = u - x;
    const N slipped = r < numeric::every<N>(0.0) ? u + moving_friction : u - moving_friction;
    return x = numeric::magnitude(r) > static_friction ? slipped : x;
  }
};

class StictionHe {
 public:
  explicit StictionHe(StictionParameters parameters) noexcept : full_(parameters) {
    set_severity(1.0);
  }

  void set_severity(double severity) noexcept {
    const StictionParameters now{full_.s * severity, full_.j * severity};
    law_.static_friction = now.static_friction();
    law_.moving_friction = now.moving_friction();
  }

  double reset(double u) noexcept { return law_.x = u; }
  double step(double u) noexcept { return std::isfinite(u) ? law_.step(u) : law_.x; }

 private:
  StictionParameters full_;
  HeLaw<double> law_{};  // CO units
};

}  // namespace loopwarden::effects
