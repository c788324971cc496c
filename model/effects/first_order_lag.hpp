// SPDX-License-Identifier: Apache-2.0
// First-order lag (effects `extra_lag` and `positioner_lag`; also inside the transmitter).
//
//   T x' = u - x,  solved exactly for u held over a period:
//   x(k) = a x(k-1) + (1 - a) u,  a = exp(-h/T)
//
//   u, x  same units     T  time constant, s, >= 0 (0: x = u)     h  s
//
// Severity p fades it in as time constant p T.
// Errors: no exceptions; if u is not finite, neither is x until the next reset.
// Limits: no rate limit (see low_air_supply.hpp), no dead time.
//
// Source: Franklin, Powell and Workman, Digital Control of Dynamic Systems (1998), zero-order hold.
#pragma once

#include <cmath>

namespace loopwarden::effects {

class FirstOrderLag {
 public:
  FirstOrderLag(double time_constant_s, double period_s) noexcept
      : time_constant_s_(time_constant_s), period_s_(period_s) {
    set_severity(1.0);
  }

  void set_severity(double severity) noexcept {
    const double time_s = time_constant_s_ * severity;
    keep_ = time_s > 0.0 ? std::exp(-period_s_ / time_s) : 0.0;
  }
  double reset(double u) noexcept { return x_ = u; }
  double step(double u) noexcept { return x_ = u + keep_ * (x_ - u); }

 private:
  double time_constant_s_;
  double period_s_;
  double keep_ = 0.0;  // a
  double x_ = 0.0;
};

}  // namespace loopwarden::effects
