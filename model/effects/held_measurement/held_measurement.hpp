// SPDX-License-Identifier: Apache-2.0
// A measurement that is updated only at intervals (effect `held_measurement`).
//
//   y(t) = q(F + n I),  n the whole part of (t - F) / I
//
//   q, y  PV units, output of the transmitter with its noise     I  interval, s, > 0
//   t     s, time of the record
//   F     first, s: time of an update; before it y keeps its value of t = 0
//
// Causes: analysers and chromatographs, wireless and multiplexed transmitters, slow gateways.
//
// Severity p fades it in as q + p (y - q).
// Errors: no exceptions.
// Limits: updates are at multiples of I, rounded up to the next sample. The transport of an
// analyser's sample is a separate dead time. The effect on the loop equals a dead time of I/2.
//
// Source: Franklin, Powell and Workman, Digital Control of Dynamic Systems (1998), zero-order hold.
#pragma once

#include <cmath>

namespace loopwarden::effects {

class HeldMeasurement {
 public:
  static constexpr bool kActsOnReading = true;

  explicit HeldMeasurement(double interval_s, double first_s = 0.0) noexcept
      : interval_s_(interval_s), first_s_(first_s) {}

  void set_severity(double severity) noexcept { severity_ = severity; }
  double reset(double q) noexcept {
    interval_ = whole(0.0);
    return held_ = q;
  }
  double step(double q, double time_s) noexcept {
    const double interval = whole(time_s);
    if (interval != interval_) {
      interval_ = interval;
      held_ = q;
    }
    return std::lerp(q, held_, severity_);
  }

 private:
  // A time that is a multiple of the interval except for rounding counts as a multiple.
  double whole(double time_s) const noexcept {
    return std::floor((time_s - first_s_) / interval_s_ + 1e-9);
  }

  double interval_s_;      // s
  double first_s_;         // s
  double interval_ = 0.0;  // n
  double held_ = 0.0;      // PV units
  double severity_ = 1.0;
};

}  // namespace loopwarden::effects
