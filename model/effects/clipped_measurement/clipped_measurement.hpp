// SPDX-License-Identifier: Apache-2.0
// A measurement that is clipped inside its range (effect `clipped_measurement`).
//
//   y = clamp(q, lo, hi)
//
//   q, y    PV units, output of the transmitter with its noise
//   lo, hi  low and high, PV units, lo < hi; one of them can be absent
//
// Causes: a span of the transmitter that is too small, a converter or an isolator that saturates, a
// scaling in the control system that is too narrow, a float at its stop.
//
// Severity p fades it in as q + p (y - q).
// Errors: no exceptions; if q is not a number, neither is y.
// Limits: beyond an end the record has no information about PV, so a fit can use such samples only
// as a bound.
//
// Source: Tobin, Econometrica 26 (1958) 24-36 (censored observations).
#pragma once

#include <algorithm>

namespace loopwarden::effects {

class ClippedMeasurement {
 public:
  static constexpr bool kActsOnReading = true;

  ClippedMeasurement(double low, double high) noexcept : low_(low), high_(high) {}

  void set_severity(double severity) noexcept { severity_ = severity; }
  double reset(double q) noexcept { return step(q); }
  double step(double q) noexcept { return std::lerp(q, std::clamp(q, low_, high_), severity_); }

 private:
  double low_;   // PV units
  double high_;  // PV units
  double severity_ = 1.0;
};

}  // namespace loopwarden::effects
