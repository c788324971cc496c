// SPDX-License-Identifier: Apache-2.0
// A motor drive with a dead band (effect `deadband_drive`).
//
//   at rest:   x' = 0, until |u - x| > B; then it starts
//   moving:    x' = R sign(u - x), until x = u; then it stops
//
//   u, x  CO units     B  band, CO units, >= 0     R  rate, CO units/s, > 0
//
// Solved exactly over a period with u held.
// Severity p fades it in as band p B and rate R/p.
//
// Errors: no exceptions; if u is not finite, the stem keeps its position.
// Limits: the motor starts without delay and never overruns; the rate on closing equals that on
// opening.
//
// Source: three-position control of electric actuators: Merz, Regelungstechnik im Maschinenbau und
// Anlagenbau (three-step controller with motor actuator); IEC 60534-4 (dead band).
#pragma once

#include <algorithm>
#include <cmath>

namespace loopwarden::effects {

class DeadbandDrive {
 public:
  DeadbandDrive(double band, double rate, double period_s) noexcept
      : full_band_(band), full_move_(rate * period_s), band_(band), move_(full_move_) {}

  void set_severity(double severity) noexcept {
    band_ = full_band_ * severity;
    move_ = full_move_ / severity;  // infinite at severity 0
  }
  double reset(double u) noexcept {
    moves_ = false;
    return x_ = u;
  }
  double step(double u) noexcept {
    if (!std::isfinite(u)) return x_;
    const double distance = u - x_;
    moves_ = moves_ || std::abs(distance) > band_;
    if (!moves_) return x_;
    if (std::abs(distance) > move_) return x_ += std::copysign(move_, distance);
    moves_ = false;
    return x_ = u;
  }
  bool moves() const noexcept { return moves_; }  // the drive has not reached u yet

 private:
  double full_band_, full_move_;  // CO units
  double band_, move_;            // CO units
  double x_ = 0.0;                // CO units
  bool moves_ = false;
};

}  // namespace loopwarden::effects
