// SPDX-License-Identifier: Apache-2.0
// Inverse response: PV first moves the wrong way (effect `inverse_response`).
//
//   x = w - Z w',  w = u through a lag of V:  x(k) = w(k) - Z (w(k) - w(k-1)) / h
//
//   u, x  CO units, at the input of the process     Z  zero_time, s, >= 0     V  lag, s, >= 0 (0: w = u)     h  s
//
// Behind it stands the process, so that CO to PV is K (1 - Z p) e^(-L p) / ((V p + 1)(T p + 1)). Without V PV jumps after
// a step of CO by Z/T of the whole change to the wrong side; two opposing lags T and V with weights 1 + g and -g make
// Z = g T - (1 + g) V. Seen where two ways from valve to PV work against
// each other and the weaker one is the faster: shrink and swell of a boiler drum, reboiler level.
//
// Severity p fades it in as p Z and p V.
// Errors: no exceptions; if u is not finite, neither is x for two samples.
// Limits: one wrong way; linear.
//
// Source: Iinoya and Altpeter, Ind. Eng. Chem. 54 (1962) 39-43 (inverse response from two opposing
// lags); Astrom and Bell, Automatica 36 (2000) 363-378 (drum level).
#pragma once

#include "model/plant/first_order_lag.hpp"

namespace loopwarden::plant {

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
  double samples_;  // Z / h, as far as it is there
  FirstOrderLag lag_;
  double last_ = 0.0;  // w(k-1)
};

}  // namespace loopwarden::plant
