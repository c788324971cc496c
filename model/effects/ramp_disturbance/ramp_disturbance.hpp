// SPDX-License-Identifier: Apache-2.0
// Ramp disturbance: a disturbance that grows gradually and stays (effect `ramp_disturbance`).
//
//   y = q + A clamp( (t - F) / (E - F), 0, 1 )
//
//   q, y, A  PV units (A: size)     F, E  from and to, s, F < E     t  s, time of the record
//
// Limits: it is added to PV, not before the process's lag; linear from beginning to end.
#pragma once

#include <algorithm>

namespace loopwarden::effects {

class RampDisturbance {
 public:
  RampDisturbance(double size, double from_s, double to_s) noexcept
      : size_(size), from_s_(from_s), length_s_(to_s - from_s) {}

  void set_severity(double severity) noexcept { severity_ = severity; }
  double reset(double q) noexcept { return q; }
  double step(double q, double time_s) noexcept {
    return q + severity_ * size_ * std::clamp((time_s - from_s_) / length_s_, 0.0, 1.0);
  }

 private:
  double size_;      // PV units
  double from_s_;    // s
  double length_s_;  // s
  double severity_ = 1.0;
};

}  // namespace loopwarden::effects
