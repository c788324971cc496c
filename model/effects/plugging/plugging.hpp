// SPDX-License-Identifier: Apache-2.0
// Plugging of an impulse line or a sensing element: a growing lag (effect `plugging`).
//
//   T(t) y' = q - y     T(t) = R t, solved exactly for q held over a period
//
//   q, y  PV units     R  rate, s/s, >= 0     t  s, from the start of the record
//
// Causes: dirt in an impulse line, a coated electrode, a fouled thermowell. The reading is later
// and later; at rest it is correct.
//
// Severity p fades it in as rate p R.
// Errors: no exceptions; if q is not a number, neither is y until the next reset.
// Limits: the growth has no end; a completely blocked line, which freezes PV, is not modelled.
//
// Source: Kaldor, in Liptak (ed.), Instrument Engineers' Handbook (2003), impulse lines as
// first-order lags.
#pragma once

#include <cmath>

namespace loopwarden::effects {

class Plugging {
 public:
  Plugging(double rate, double period_s) noexcept : rate_(rate), period_s_(period_s) {}

  void set_severity(double severity) noexcept { severity_ = severity; }
  double reset(double q) noexcept { return y_ = q; }
  double step(double q, double time_s) noexcept {
    const double lag_s = severity_ * rate_ * time_s;
    return y_ = lag_s > 0.0 ? q + std::exp(-period_s_ / lag_s) * (y_ - q) : q;
  }

 private:
  double rate_;      // s/s
  double period_s_;  // s
  double severity_ = 1.0;
  double y_ = 0.0;  // PV units
};

}  // namespace loopwarden::effects
