// SPDX-License-Identifier: Apache-2.0
// Hysteresis in the form of the thesis: an offset while the output falls (effect `hysteresis` with
// `offset`).
//
//   x = u            while u rises
//   x = u + offset   while u falls; the branch doesn't change while u is constant
//
//   u, x, offset  CO units; offset of either sign
//
// Errors: no exceptions; if u is not finite, neither is x.
// Limits: x jumps on the smallest reversal, even on one by noise, so there are no minor loops. For
// a gradual loop see hysteresis_width.hpp.
//
// Source: Sewdass, thesis (Durban University of Technology), section 7.3.4.
#pragma once

namespace loopwarden::effects {

// Selects the branch: whether u falls.
struct FallingLaw {
  double last_u = 0.0;
  bool falling = false;
  bool step(double u) noexcept {
    if (u != last_u) falling = u < last_u;
    last_u = u;
    return falling;
  }
};

class HysteresisOffset {
 public:
  explicit HysteresisOffset(double offset) noexcept : full_(offset), offset_(offset) {}

  void set_severity(double severity) noexcept { offset_ = full_ * severity; }

  double reset(double u) noexcept {
    law_ = {u, false};
    return u;
  }

  double step(double u) noexcept { return law_.step(u) ? u + offset_ : u; }

 private:
  double full_;    // CO units
  double offset_;  // CO units
  FallingLaw law_;
};

}  // namespace loopwarden::effects
