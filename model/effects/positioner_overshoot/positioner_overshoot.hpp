// SPDX-License-Identifier: Apache-2.0
// Positioner overshoot: an underdamped positioner and actuator (effect `positioner_overshoot`).
//
//   x'' + 2 Z W x' + W^2 x = W^2 u,   solved exactly for u held over a period
//
//   u, x  CO units     Z  damping ratio, 0 < Z < 1     W  natural_frequency, rad/s, > 0
//
// At an end of the travel the stem stops. If a swing would carry it beyond the end, it stays there,
// x' = 0, until CO moves it back. The ends are checked once per period.
//
// Severity p fades it in as u + p (x - u).
// Errors: no exceptions; if u is not finite, neither is x until the next reset.
// Limits: linear, so the overshoot is the same share of a step of any size; no rate limit.
//
// Source: Franklin, Powell and Workman, Digital Control of Dynamic Systems (1998), zero-order hold.
#pragma once

#include "model/effects/travel.hpp"

namespace loopwarden::effects {

class PositionerOvershoot {
 public:
  PositionerOvershoot(double damping, double natural_frequency_rad_s, double period_s,
                      Travel travel = {}) noexcept;

  void set_severity(double severity) noexcept { severity_ = severity; }
  double reset(double u) noexcept;
  double step(double u) noexcept;

 private:
  // One period of the free motion of (x - u, x').
  double xx_, xv_, vx_, vv_;
  Travel travel_;
  double severity_ = 1.0;
  double x_ = 0.0;  // CO units
  double v_ = 0.0;  // CO units/s
};

}  // namespace loopwarden::effects
