// SPDX-License-Identifier: Apache-2.0
// Hysteresis in the thesis's form: another branch while the output falls (effect `hysteresis` with
// `offset`).
//
//   x = u            while u rises
//   x = u + offset   while u falls; the branch stays as it is while u stands still
//
//   u, x, offset  CO units; offset of either sign
//
// Errors: none; a non-finite u gives a non-finite x.
// What it can't do: it jumps at once on the smallest reversal, noise included: no minor loops. For
// a gradual loop see hysteresis_width.hpp.
//
// Source: Sewdass, thesis (Durban University of Technology), section 7.3.4.
#pragma once

namespace loopwarden::plant {

class HysteresisOffset {
 public:
  explicit HysteresisOffset(double offset) noexcept : full_(offset), offset_(offset) {}

  void set_severity(double severity) noexcept { offset_ = full_ * severity; }

  double reset(double u) noexcept {
    last_u_ = u;
    falling_ = false;
    return u;
  }

  double step(double u) noexcept {
    if (u != last_u_) falling_ = u < last_u_;
    last_u_ = u;
    return falling_ ? u + offset_ : u;
  }

 private:
  double full_;          // CO units
  double offset_;        // CO units
  double last_u_ = 0.0;  // CO units
  bool falling_ = false;
};

}  // namespace loopwarden::plant
