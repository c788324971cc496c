// SPDX-License-Identifier: Apache-2.0
// Resolution: the stem moves in steps (effect `resolution`).
//
//   x = lo + D floor( (u - lo) / D + 1/2 )
//
//   u, x  CO units     D  step, CO units, >= 0 (0: x = u)     lo  lower end of the output, CO units
//
// Causes: stepping actuators, coarse converters in a positioner, and positioners with a dead zone.
//
// Severity p fades it in as p D.
// Errors: no exceptions; if u is not finite, neither is x.
// Limits: every step is complete within a sample, and the stem steps at the same places up and
// down. A stem that needs more CO after a reversal has `backlash` or `stiction`.
//
// Source: ANSI/ISA-75.25.01 (2000), resolution: the least step in one direction that moves the
// valve; Widrow and Kollar, Quantization Noise (2008), the uniform quantizer.
#pragma once

#include <cmath>

namespace loopwarden::effects {

class Resolution {
 public:
  Resolution(double step, double low) noexcept : full_(step), step_(step), low_(low) {}

  void set_severity(double severity) noexcept { step_ = full_ * severity; }
  double reset(double u) noexcept { return step(u); }
  double step(double u) noexcept {
    return step_ > 0.0 ? low_ + step_ * std::floor((u - low_) / step_ + 0.5) : u;
  }

 private:
  double full_;  // CO units
  double step_;  // CO units
  double low_;   // CO units
};

}  // namespace loopwarden::effects
