// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace loopwarden::effects {

// The two parameters of every stiction law, and the friction that follows from them. Forces are
// divided by the spring rate, so that all are in CO units.
//
//   s   deadband + stickband: travel of CO after a reversal before the stem moves
//   j   slip jump: jump of the stem at that moment
//   static friction  fs = (s + j) / 2       moving friction  fd = (s - j) / 2
//
// Ranges: s >= 0, 0 <= j <= s. (j > s, overshooting slip, would need a negative moving friction.)
// Source: Choudhury, Thornhill and Shah, Control Engineering Practice 13 (2005).
struct StictionParameters {
  double s = 0.0;  // CO units
  double j = 0.0;  // CO units

  constexpr double static_friction() const noexcept { return (s + j) / 2.0; }
  constexpr double moving_friction() const noexcept { return (s - j) / 2.0; }
};

}  // namespace loopwarden::effects
