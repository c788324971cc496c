// SPDX-License-Identifier: Apache-2.0
// Cam obstruction: the stem sticks and jumps at one place of its travel (effect `cam_obstruction`).
//
// A bump on the positioner's cam holds the follower until CO has pushed far enough, on the way up
// and on the way down. Below it the stem follows u, beyond it at an offset of band - jump:
//
//   below:  x = min(u, P);                      passes when u > P + B
//   above:  x = max(u - (B - J), P + J);        passes back when u < P
//
//   u, x  CO units     P  position, CO units     B  band, CO units, > 0: CO that it takes to pass
//   J     jump, CO units, 0 <= J <= B: how far the stem then jumps
//
// Severity p fades it in as p B and p J.
// Errors: no exceptions; a u that is not a number gives such an x, and the stem stays on its side.
// Limits: no dynamics of the jump; friction elsewhere along the travel is `stiction`.
//
// Source: Sewdass, thesis (Durban University of Technology), section 7.3.2 and figure 7.7: the
// obstruction by which its stiction signatures were made.
#pragma once

#include <algorithm>

namespace loopwarden::plant {

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

}  // namespace loopwarden::plant
