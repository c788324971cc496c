// SPDX-License-Identifier: Apache-2.0
// Backlash: lost motion between actuator and plug, as the play operator (effect `backlash`).
//
//   x(k) = clamp( x(k-1), u - D/2, u + D/2 )
//
//   u, x  CO units     D  deadband, CO units, >= 0: travel that CO loses on a reversal
//
// Errors: no exceptions; if u is not a number, x keeps its value.
// Limits: no inertia, no slip jump (see stiction), no wear along the travel.
//
// Source: Tao and Kokotovic, Adaptive Control of Systems with Actuator and Sensor Nonlinearities
// (Wiley 1996), ch. 2 (friction-driven backlash).
#pragma once

#include "model/numeric/lanes.hpp"

namespace loopwarden::effects {

// The equation for one stem (N is a number) or for several stems in parallel (numeric/lanes.hpp).
template <class N>
struct PlayLaw {
  N half;  // D/2
  N x;
  N step(N u) noexcept { return x = numeric::within(x, u - half, u + half); }
};

class Backlash {
 public:
  explicit Backlash(double deadband) noexcept : full_(deadband / 2.0), law_{full_, 0.0} {}

  void set_severity(double severity) noexcept { law_.half = full_ * severity; }
  double reset(double u) noexcept { return law_.x = u; }
  double step(double u) noexcept { return law_.step(u); }

 private:
  double full_;  // CO units, half the deadband at full severity
  PlayLaw<double> law_;
};

}  // namespace loopwarden::effects
