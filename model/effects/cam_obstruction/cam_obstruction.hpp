// SPDX-License-Identifier: Apache-2.0
// Cam obstruction: the stem sticks and jumps at one place of its travel (effect `cam_obstruction`).
//
// A bump on the cam of the positioner holds the follower until CO has moved far enough, up and
// down. Below the bump the stem follows u, above it with an offset of band - jump:
//
//   below:  x = min(u, P);                      passes when u > P + B
//   above:  x = max(u - (B - J), P + J);        passes back when u < P
//
//   u, x  CO units     P  position, CO units
//   B     band, CO units, > 0: move of CO that passes the bump
//   J     jump, CO units, 0 <= J <= B: jump of the stem at the bump
//
// Severity p fades it in as p B and p J.
// Errors: no exceptions; if u is not a number, neither is x, and the stem stays on its side.
// Limits: no dynamics of the jump; friction elsewhere along the travel is `stiction`.
//
// Source: Sewdass, thesis (Durban University of Technology), section 7.3.2 and figure 7.7: the
// obstruction that produced the stiction signatures of the thesis.
#pragma once

#include <algorithm>

namespace loopwarden::effects {

class CamObstruction {
 public:
  CamObstruction(double position, double band, double jump) noexcept
      : position_(position), full_band_(band), full_jump_(jump), band_(band), jump_(jump) {}

  void set_severity(double severity) noexcept {
    band_ = full_band_ * severity;
    jump_ = full_jump_ * severity;
  }

  double reset(double u) noexcept {
    above_ = u > position_ + band_;
    return stem(u);
  }

  double step(double u) noexcept {
    if (above_ ? u < position_ : u > position_ + band_) above_ = !above_;
    return stem(u);
  }

 private:
  double stem(double u) const noexcept {
    return above_ ? std::max(u - (band_ - jump_), position_ + jump_) : std::min(u, position_);
  }

  double position_;   // CO units
  double full_band_;  // CO units
  double full_jump_;  // CO units
  double band_;       // CO units
  double jump_;       // CO units
  bool above_ = false;
};

}  // namespace loopwarden::effects
