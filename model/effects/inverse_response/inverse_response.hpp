// SPDX-License-Identifier: Apache-2.0
// Inverse response: PV first moves the wrong way (effect `inverse_response`).
//
//   x = w - Z w',  w = u through a lag of V:  x(k) = w(k) - Z (w(k) - w(k-1)) / h
//
//   u, x  CO units, at the input of the process     h  s
//   Z     zero_time, s, >= 0                        V  lag, s, >= 0 (0: w = u)
//
// The process follows, so the transfer function from CO to PV is
//   K (1 - Z p) e^(-L p) / ((V p + 1)(T p + 1))
// If V is 0, a step of CO makes PV jump in the wrong direction by Z/T of the whole change. Two
// opposing lags T and V with weights 1 + g and -g give Z = g T - (1 + g) V.
// Occurs if two paths from valve to PV oppose each other and the weaker one is faster: shrink and
// swell of a boiler drum, reboiler level.
//
// Severity p fades it in as p Z and p V.
// Errors: no exceptions; if u is not finite, neither is x for two samples.
// Limits: linear; PV moves in the wrong direction only once per move of CO.
//
// Source: Iinoya and Altpeter, Ind. Eng. Chem. 54 (1962) 39-43 (inverse response from two opposing
// lags); Astrom and Bell, Automatica 36 (2000) 363-378 (drum level).
#pragma once

#include "model/effects/first_order_lag.hpp"

namespace loopwarden::effects {

class InverseResponse {
 public:
  InverseResponse(double zero_time_s, double lag_s, double period_s) noexcept
      : full_(zero_time_s / period_s), samples_(full_), lag_(lag_s, period_s) {}

  void set_severity(double severity) noexcept {
    samples_ = full_ * severity;
    lag_.set_severity(severity);
  }
  double reset(double u) noexcept { return last_ = lag_.reset(u); }
  double step(double u) noexcept {
    const double w = lag_.step(u);
    const double x = w - samples_ * (w - last_);
    last_ = w;
    return x;
  }

 private:
  double full_;     // Z / h
  double samples_;  // Z / h at the present severity
  FirstOrderLag lag_;
  double last_ = 0.0;  // w(k-1)
};

}  // namespace loopwarden::effects
