// SPDX-License-Identifier: Apache-2.0
// Stiction, data-driven law with two parameters (effect `stiction`, law `choudhury`, the default).
//
// The stem x follows the command u at the distance of the moving friction, and sticks whenever u
// stops or turns:
//
//   stuck:   x stays, until |u - x| > fs; then it slips to x = u - sign(u - x) fd
//   moving:  x = u - d fd while u goes on in direction d; sticks (x stays) when u stops or turns
//
//   u  CO units in     x  CO units out     d  direction of motion, -1 or +1
//   fs, fd  CO units, see stiction_law.hpp
//
// After a stop in the same direction this takes j of further CO before it moves, after a reversal s,
// as in the paper's flow chart, written there with the value of u at which the stem stuck.
//
// Errors: none. A non-finite u leaves the stem where it is.
// What it can't do: it is quasi-static, so a slip is complete within one sample, and the stem stops
// exactly when u does; no dependence on velocity (Stribeck), no creep, no drift of friction along the
// travel. Noise on u makes it stick and slip at every turn.
//
// Source: Choudhury, Thornhill and Shah, "Modelling valve stiction", Control Engineering Practice 13
// (2005) 641-658.
#pragma once

#include <cmath>

#include "model/plant/stiction_law.hpp"

namespace loopwarden::plant {

class StictionChoudhury {
 public:
  explicit StictionChoudhury(StictionParameters parameters) noexcept : full_(parameters) {
    set_severity(1.0);
  }

  void set_severity(double severity) noexcept {
    const StictionParameters now{full_.s * severity, full_.j * severity};
    static_friction_ = now.static_friction();
    moving_friction_ = now.moving_friction();
  }

  double reset(double u) noexcept {
    last_u_ = u;
    x_ = u;
    direction_ = 0.0;
    return x_;
  }

  double step(double u) noexcept {
    if (!std::isfinite(u)) return x_;
    const double change = u - last_u_;
    last_u_ = u;
    if (direction_ != 0.0 && change * direction_ <= 0.0) direction_ = 0.0;  // stopped or turned
    if (direction_ == 0.0 && std::abs(u - x_) > static_friction_) direction_ = u > x_ ? 1.0 : -1.0;
    if (direction_ != 0.0) x_ = u - direction_ * moving_friction_;
    return x_;
  }

 private:
  StictionParameters full_;
  double static_friction_ = 0.0;  // CO units
  double moving_friction_ = 0.0;  // CO units
  double last_u_ = 0.0;           // CO units
  double x_ = 0.0;                // CO units
  double direction_ = 0.0;        // 0: stuck
};

}  // namespace loopwarden::plant
