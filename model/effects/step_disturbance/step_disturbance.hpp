// SPDX-License-Identifier: Apache-2.0
// Step disturbance (effect `step_disturbance`).
//
//   y = q + (t >= T ? A : 0)
//
//   q, y, A  PV units (A: size)     T  time, s     t  s, time of the record
//
// Limits: it is added to PV directly, not before the process's lag.
#pragma once

namespace loopwarden::effects {

class StepDisturbance {
 public:
  StepDisturbance(double size, double time_s) noexcept : size_(size), time_s_(time_s) {}

  void set_severity(double severity) noexcept { severity_ = severity; }
  double reset(double q) noexcept { return q; }
  double step(double q, double time_s) noexcept {
    return time_s >= time_s_ ? q + severity_ * size_ : q;
  }

 private:
  double size_;    // PV units
  double time_s_;  // s
  double severity_ = 1.0;
};

}  // namespace loopwarden::effects
