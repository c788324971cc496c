// SPDX-License-Identifier: Apache-2.0
// Impulse line or sensing element that plugs (effect `plugging`): a lag that grows.
//
//   T(t) y' = q - y     T(t) = R t, solved exactly for q held over a period
//
//   q, y  PV units     R  rate, s/s, >= 0     t  s, from the start of the record
//
// Dirt in an impulse line, a coated electrode, a fouled thermowell: what the transmitter sees comes later and later; at rest
// it is right.
//
// Severity p fades it in as rate p R.
// Errors: no exceptions; a q that is not a number stays so until the next reset.
// Limits: no end to the growth; a line that is shut altogether shows a PV that stands.
//
// Source: Kaldor, in Liptak (ed.), Instrument Engineers' Handbook (2003), impulse lines as first-order lags.
#pragma once

#include <cmath>

namespace loopwarden::plant {

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

}  // namespace loopwarden::plant
