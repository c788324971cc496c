// SPDX-License-Identifier: Apache-2.0
// Measurement that ends inside its range (effect `clipped_measurement`).
//
//   y = clamp(q, lo, hi)
//
//   q, y  PV units, what the transmitter puts out, noise included     lo, hi  low and high, PV units,
//   lo < hi; either may be absent
//
// Seen with a transmitter whose span was set too small, a converter or an isolator that saturates, a scaling
// in the control system that stops short, a float at its stop.
//
// Severity p fades it in as q + p (y - q).
// Errors: no exceptions; if q is not a number, so is y.
// Limits: beyond its end the record holds nothing of PV, so a fit can only count such samples as
// a bound.
//
// Source: Tobin, Econometrica 26 (1958) 24-36 (censored observations).
#pragma once

#include <algorithm>
#include <cmath>

namespace loopwarden::plant {

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

}  // namespace loopwarden::plant
