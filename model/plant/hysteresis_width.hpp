// SPDX-License-Identifier: Apache-2.0
// Hysteresis as a distributed play: a loop that opens gradually after each reversal (effect
// `hysteresis` with `width`). Prandtl-Ishlinskii operator with n equally weighted plays:
//
//   x = (1/n) sum x_i,   x_i(k) = clamp( x_i(k-1), u - r_i, u + r_i )
//   r_i = c max(0, k + 2 (1 - k)(i - 1/2)/n),   c such that the mean of r_i is width / 2
//
//   u, x   CO units     r_i  CO units, half the deadband of play i = 1..n     n = 12
//   width  CO units, >= 0: distance between the rising and the falling branch after a large reversal
//   k      knee, -4 to 1: how late and sharply the new branch begins. 1: all plays alike, which is
//          backlash; 0: widths spread evenly from nothing; below 0: part of the flow has no play at all
//
// Errors: none; a u that is not a number leaves x where it is.
// What it can't do: one shape parameter, and it does not depend on the rate.
//
// Source: Hassani, Tjahjowidodo and Do, Mech. Syst. Signal Process. 49 (2014) 209-233 (survey).
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

namespace loopwarden::plant {

class HysteresisWidth {
 public:
  explicit HysteresisWidth(double width, double knee = 0.0) noexcept {
    double sum = 0.0;
    for (std::size_t i = 0; i < kPlays; ++i) {
      const double place = 2.0 * (static_cast<double>(i) + 0.5) / static_cast<double>(kPlays);
      halves_[i] = std::max(0.0, knee + (1.0 - knee) * place);
      sum += halves_[i];
    }
    for (double& half : halves_) half *= 0.5 * width * static_cast<double>(kPlays) / sum;
  }

  void set_severity(double severity) noexcept { severity_ = severity; }

  double reset(double u) noexcept {
    plays_.fill(u);
    return u;
  }

  double step(double u) noexcept {
    double sum = 0.0;
    for (std::size_t i = 0; i < kPlays; ++i) {
      const double half = severity_ * halves_[i];
      plays_[i] = std::clamp(plays_[i], u - half, u + half);
      sum += plays_[i];
    }
    return sum / static_cast<double>(kPlays);
  }

 private:
  static constexpr std::size_t kPlays = 12;
  std::array<double, kPlays> halves_{};  // CO units
  double severity_ = 1.0;
  std::array<double, kPlays> plays_{};  // CO units
};

}  // namespace loopwarden::plant
