// SPDX-License-Identifier: Apache-2.0
// Inverse response: PV first moves the wrong way (effect `inverse_response`).
//
//   x = u - Z u',   by backward difference:  x(k) = u(k) - Z (u(k) - u(k-1)) / h
//
//   u, x  CO units, at the input of the process     Z  zero_time, s, >= 0     h  s
//
// Behind it stands the process, so that CO to PV is K (1 - Z p) e^(-L p) / (T p + 1): after a step of CO
// PV jumps by Z/T of the whole change to the wrong side. Seen where two ways from valve to PV work against
// each other and the weaker one is the faster: shrink and swell of a boiler drum, reboiler level.
//
// Severity p fades it in as p Z.
// Errors: none; a non-finite u gives a non-finite x for two samples.
// What it can't do: the wrong way is taken at once, not through a lag of its own; linear.
//
// Source: Iinoya and Altpeter, Ind. Eng. Chem. 54 (1962) 39-43 (inverse response from two opposing
// lags); Astrom and Bell, Automatica 36 (2000) 363-378 (drum level).
#pragma once

namespace loopwarden::plant {

class InverseResponse {
 public:
  InverseResponse(double zero_time_s, double period_s) noexcept
      : full_(zero_time_s / period_s), samples_(full_) {}

  void set_severity(double severity) noexcept { samples_ = full_ * severity; }
  double reset(double u) noexcept { return last_u_ = u; }
  double step(double u) noexcept {
    const double x = u - samples_ * (u - last_u_);
    last_u_ = u;
    return x;
  }

 private:
  double full_;     // Z / h
  double samples_;  // Z / h, as far as it is there
  double last_u_ = 0.0;
};

}  // namespace loopwarden::plant
