// SPDX-License-Identifier: Apache-2.0
// Stiction: a data-driven law with two parameters (effect `stiction`, law `choudhury`, the
// default).
//
// The stem x follows the command u at the distance of the moving friction, and sticks whenever u
// stops or turns:
//
//   stuck:   x stays until |u - x| > fs; then it slips to x = u - sign(u - x) fd
//   moving:  x = u - d fd while u continues in direction d; sticks (x stays) when u stops or turns
//
//   u  CO units in     x  CO units out     d  direction of motion, -1 or +1
//   fs, fd  CO units, see stiction_law.hpp
//
// After a stop the stem needs a further CO of j to move in the same direction, and s after a
// reversal. This agrees with the flow chart of the paper, which uses the value of u at which the
// stem stuck.
//
// Errors: no exceptions. If u is not finite, the stem keeps its position.
// Limits: it is quasi-static, so a slip is complete within one sample, and the stem stops exactly
// when u does. No dependence on velocity (Stribeck), no creep, no change of friction along the
// travel. With noise on u the stem sticks and slips at every turn.
//
// Source: Choudhury, Thornhill and Shah, "Modelling valve stiction", Control Engineering Practice
// 13 (2005) 641-658.
#pragma once

#include <cmath>

#include "model/numeric/lanes.hpp"
#include "model/effects/stiction/stiction_law.hpp"

namespace loopwarden::effects {

// The equation for one stem or for several stems in parallel (numeric/lanes.hpp).
template <class N>
struct ChoudhuryLaw {
  N static_friction;
  N moving_friction;
  N x;
  N last_u;
  N direction;  // -1 or 1, 0 while stuck
  N step(N u) noexcept {
    const N zero = numeric::every<N>(0.0);
    const N one = numeric::every<N>(1.0);
    const N change = u - last_u;
    last_u = u;
    direction = change * direction > zero ? direction : zero;  // 0: u has stopped or turned
    const N r = u - x;
    const N way = r > zero ? one : -one;
    const N starts = numeric::magnitude(r) > static_friction ? way : zero;
    direction = numeric::magnitude(direction) > zero ? direction : starts;
    return x = numeric::magnitude(direction) > zero ? u - direction * moving_friction : x;
  }
};

class StictionChoudhury {
 public:
  explicit StictionChoudhury(StictionParameters parameters) noexcept : full_(parameters) {
    set_severity(1.0);
  }

  void set_severity(double severity) noexcept {
    const StictionParameters now{full_.s * severity, full_.j * severity};
    law_.static_friction = now.static_friction();
    law_.moving_friction = now.moving_friction();
  }

  double reset(double u) noexcept {
    law_.last_u = u;
    law_.direction = 0.0;
    return law_.x = u;
  }
  double step(double u) noexcept { return std::isfinite(u) ? law_.step(u) : law_.x; }

 private:
  StictionParameters full_;
  ChoudhuryLaw<double> law_{};  // CO units
};

}  // namespace loopwarden::effects
