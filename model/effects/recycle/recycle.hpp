// SPDX-License-Identifier: Apache-2.0
// Recycle: part of the outflow returns late and mixes with the inflow (effect `recycle`).
//
//   x(k) = (1 - R) u(k) + R w(k)     w = x(t - D) through a lag of T, linear between samples
//
//   u, x  same units     R  share that returns, 0 to 0.95
//   D     delay, s, >= one sample     T  time_constant, s, >= 0
//
// It acts at the input of the process; for a linear process this equals an effect at its output.
// The final PV doesn't change, but PV reaches it in stairs. Each stair is R times the one before,
// and D + T later. Examples: heat exchangers between feed and effluent, reflux, a return header,
// recycled solvent.
//
// Severity p fades it in as p R.
// Errors: the constructor throws std::length_error if the delay doesn't fit in memory.
// Limits: one return path; no share above 0.95, which is near to instability.
//
// Source: Luyben, Ind. Eng. Chem. Res. 32 (1993) 466-475 (dynamics of recycle systems).
#pragma once

#include "model/effects/extra_dead_time/extra_dead_time.hpp"
#include "model/effects/first_order_lag.hpp"

namespace loopwarden::effects {

class Recycle {
 public:
  // The feedback through the last sample is one sample of the delay.
  Recycle(double share, double delay_s, double time_constant_s, double period_s)
      : full_(share),
        share_(share),
        way_(delay_s > period_s ? delay_s - period_s : 0.0, period_s),
        lag_(time_constant_s, period_s) {}

  void set_severity(double severity) noexcept { share_ = full_ * severity; }
  double reset(double u) noexcept {
    way_.reset(u);
    lag_.reset(u);
    return last_ = u;
  }
  double step(double u) noexcept {
    return last_ = (1.0 - share_) * u + share_ * lag_.step(way_.step(last_));
  }

 private:
  double full_;
  double share_;
  ExtraDeadTime way_;
  FirstOrderLag lag_;
  double last_ = 0.0;  // x(k-1)
};

}  // namespace loopwarden::effects
