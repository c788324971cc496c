// SPDX-License-Identifier: Apache-2.0
// Oscillating disturbance from another loop (effect `oscillating_disturbance`).
//
//   y = q + A sin(2 pi t / T + phase)     q, y, A  PV units     T  period, s, > 0     phase  rad
//   t  s, time of the record
//
// Limits: one harmonic of constant amplitude; it is added to PV, not before the process.
#pragma once

#include <cmath>
#include <numbers>

namespace loopwarden::effects {

class OscillatingDisturbance {
 public:
  OscillatingDisturbance(double amplitude, double period_s, double phase_rad) noexcept
      : amplitude_(amplitude), frequency_(2.0 * std::numbers::pi / period_s), phase_(phase_rad) {}

  void set_severity(double severity) noexcept { severity_ = severity; }
  double reset(double q) noexcept { return q; }
  double step(double q, double time_s) noexcept {
    return q + severity_ * amplitude_ * std::sin(frequency_ * time_s + phase_);
  }

 private:
  double amplitude_;  // PV units
  double frequency_;  // rad/s
  double phase_;      // rad
  double severity_ = 1.0;
};

}  // namespace loopwarden::effects
