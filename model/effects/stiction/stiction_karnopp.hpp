// SPDX-License-Identifier: Apache-2.0
// Stiction: a physical model of a spring-opposed actuator with Karnopp friction (effect `stiction`,
// law `karnopp`).
//
// Force balance on the stem, divided by the spring rate k:
//
//   (1 / wn^2) x'' = (u - x) - f - c x'
//   stuck   (|x'| < v0 and |u - x| <= fs):  x' = 0, f balances u - x exactly
//   moving:                                  f = fd sign(x')
//
//   u   CO units    actuator force over k           x   CO units   stem position
//   fs  CO units    static friction, (s + j) / 2    fd  CO units   moving friction, (s - j) / 2
//   wn  rad/s       sqrt(k / M)                      c   s          viscous friction over k
//   v0  CO units/s  velocity that counts as rest
//
// Constants: M = 1.36 kg, k = 52 500 N/m, viscous friction 612 N s/m (Choudhury, Thornhill and Shah
// 2005, table of the pneumatic valve): wn = 196 rad/s, c = 0.0117 s, damping ratio 1.15, so that a
// slip takes about 0.05 s and does not overshoot.
//
// The integration is semi-implicit in steps of at most 0.5 ms. While the stem moves, it takes about
// a hundred times as long as the data-driven laws; a stuck stem takes no steps. Within a period the
// force changes linearly from the last u to the new one. With a staircase of u the stem would stop
// on every stair and stick-slip; a real actuator moves on, because its air pressure changes
// gradually.
//
// Severity p fades it in as p S and p J; at 0 the stem follows u immediately.
// Errors: no exceptions. If u is not finite, the stem keeps its position.
// Limits: no Stribeck curve and no presliding (LuGre); the same friction along the whole travel; no
// pneumatics except that linear force: no lag, no rate limit (see low_air_supply.hpp).
//
// Source: Karnopp, J. Dyn. Sys., Meas., Control 107 (1985) 100-103.
#pragma once

#include "model/effects/stiction/stiction_law.hpp"

namespace loopwarden::effects {

class StictionKarnopp {
 public:
  // `period_s` > 0.
  StictionKarnopp(StictionParameters parameters, double period_s) noexcept;

  void set_severity(double severity) noexcept;
  double reset(double u) noexcept;
  double step(double u) noexcept;

 private:
  StictionParameters full_;
  int substeps_;
  double substep_s_;
  double static_friction_ = 0.0;  // CO units
  double moving_friction_ = 0.0;  // CO units
  double last_u_ = 0.0;           // CO units
  double x_ = 0.0;                // CO units
  double v_ = 0.0;                // CO units/s
};

}  // namespace loopwarden::effects
