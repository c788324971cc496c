// SPDX-License-Identifier: Apache-2.0
// Direction in which a signal moves, without small reversals.
//
//   rising until u falls below its highest value since by more than `band`, and the other way round
//   0 until u has moved by more than `band` from its first value
#pragma once

#include <algorithm>

namespace loopwarden::control {

class Reversals {
 public:
  explicit Reversals(double band) noexcept : band_(band) {}

  void reset(double u) noexcept {
    extreme_ = u;
    direction_ = 0;
  }

  // -1 falling, 1 rising, 0 not known yet.
  int step(double u) noexcept {
    const int before = direction_;
    if (u - extreme_ > band_) direction_ = 1;
    if (extreme_ - u > band_) direction_ = -1;
    if (direction_ != before) {
      extreme_ = u;
    } else if (direction_ != 0) {
      extreme_ = direction_ > 0 ? std::max(extreme_, u) : std::min(extreme_, u);
    }
    return direction_;
  }

 private:
  double band_;
  double extreme_ = 0.0;
  int direction_ = 0;
};

}  // namespace loopwarden::control
