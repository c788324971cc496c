// SPDX-License-Identifier: Apache-2.0
// Square disturbance: equipment upstream switches on and off (effect `square_disturbance`).
//
//   y = q + A m,  m the mean of sign( sin(2 pi t / T + phase) ) over a sample about t
//
//   q, y, A  PV units (A: amplitude)     T  period, s, > 0     phase  rad
//   t        s, time of the record
//
// With the mean, an edge between two samples changes its sample by the corresponding share.
//
// Limits: on and off have the same length; it is added to PV directly, not before the process's
// lag.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

namespace loopwarden::effects {

class SquareDisturbance {
 public:
  SquareDisturbance(double amplitude, double period_s, double phase_rad,
                    double sample_time_s) noexcept
      : amplitude_(amplitude),
        period_s_(period_s),
        lead_(phase_rad / (2.0 * std::numbers::pi)),
        sample_(sample_time_s / period_s) {}

  void set_severity(double severity) noexcept { severity_ = severity; }
  // The disturbance has no rest: it is on or off at the start of a record.
  double reset(double q) noexcept { return step(q, 0.0); }
  double step(double q, double time_s) noexcept {
    const double reversals = time_s / period_s_ + lead_;
    const double mean =
        (integral(reversals + sample_ / 2.0) - integral(reversals - sample_ / 2.0)) / sample_;
    return q + severity_ * amplitude_ * mean;
  }

 private:
  // Returns the integral of the sign over turns: it rises in the first half of a turn and falls in
  // the second.
  static double integral(double reversals) noexcept {
    const double in_turn = reversals - std::floor(reversals);
    return std::min(in_turn, 1.0 - in_turn);
  }

  double amplitude_;  // PV units
  double period_s_;   // s
  double lead_;       // phase, share of a period
  double sample_;     // sample time, share of a period
  double severity_ = 1.0;
};

}  // namespace loopwarden::effects
