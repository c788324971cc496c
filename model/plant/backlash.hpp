// SPDX-License-Identifier: Apache-2.0
// Backlash: lost motion between actuator and plug, as the play operator (effect `backlash`).
//
//   x(k) = clamp( x(k-1), u - D/2, u + D/2 )
//
//   u, x  CO units     D  deadband, CO units, >= 0: all that CO loses on a reversal
//
// Errors: none; a u that is not a number leaves x where it is.
// What it can't do: no inertia, no slip jump (see stiction), no wear along the travel.
//
// Source: Tao and Kokotovic, Adaptive Control of Systems with Actuator and Sensor Nonlinearities
// (Wiley 1996), ch. 2 (friction-driven backlash).
#pragma once

#include <algorithm>

namespace loopwarden::plant {

class Backlash {
 public:
  explicit Backlash(double deadband) noexcept : full_(deadband / 2.0), half_(full_) {}

  void set_severity(double severity) noexcept { half_ = full_ * severity; }
  double reset(double u) noexcept { return x_ = u; }
  double step(double u) noexcept { return x_ = std::clamp(x_, u - half_, u + half_); }

 private:
  double full_;     // CO units, half the deadband at full severity
  double half_;     // CO units
  double x_ = 0.0;  // CO units
};

}  // namespace loopwarden::plant
