// SPDX-License-Identifier: Apache-2.0
// Hysteresis as distributed play: a loop that opens gradually after each reversal (effect
// `hysteresis` with `width`). It is a Prandtl-Ishlinskii operator with n equally weighted plays:
//
//   x = (1/n) sum x_i,   x_i(k) = clamp( x_i(k-1), u - r_i, u + r_i )
//   r_i = c max(0, k + 2 (1 - k)(i - 1/2)/n),   c such that the mean of r_i is width / 2
//
//   u, x   CO units     r_i  CO units, half the deadband of play i = 1..n     n = 12
//   width  CO units, >= 0: distance of the rising and the falling branch after a large reversal
//   k      knee, -4 to 1: a larger knee makes the new branch begin later and more sharply
//          1: all plays are equal, which is backlash; 0: widths are spread evenly from 0;
//          below 0: some of the plays have no width
//
// Errors: no exceptions; if u is not a number, x keeps its value.
// Limits: one shape parameter; no dependence on the rate.
//
// Source: Hassani, Tjahjowidodo and Do, Mech. Syst. Signal Process. 49 (2014) 209-233 (survey).
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

#include "model/numeric/lanes.hpp"
#include "model/effects/backlash/backlash.hpp"

namespace loopwarden::effects {

// The equation of n plays, for one stem or for several stems in parallel (numeric/lanes.hpp).
template <class N, std::size_t n>
struct PlaysLaw {
  PlayLaw<N> plays[n];
  N step(N u) noexcept {
    N sum = numeric::every<N>(0.0);
    for (PlayLaw<N>& play : plays) sum = sum + play.step(u);
    return sum / numeric::every<N>(static_cast<double>(n));
  }
};

// Returns r_i of n plays, CO units.
template <std::size_t n>
std::array<double, n> half_deadbands(double width, double knee) noexcept {
  std::array<double, n> halves{};
  double sum = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    const double place = 2.0 * (static_cast<double>(i) + 0.5) / static_cast<double>(n);
    halves[i] = std::max(0.0, knee + (1.0 - knee) * place);
    sum += halves[i];
  }
  for (double& half : halves) half *= 0.5 * width * static_cast<double>(n) / sum;
  return halves;
}

class HysteresisWidth {
 public:
  explicit HysteresisWidth(double width, double knee = 0.0) noexcept
      : halves_(half_deadbands<kPlays>(width, knee)) {
    set_severity(1.0);
  }

  void set_severity(double severity) noexcept {
    for (std::size_t i = 0; i < kPlays; ++i) law_.plays[i].half = severity * halves_[i];
  }

  double reset(double u) noexcept {
    for (PlayLaw<double>& play : law_.plays) play.x = u;
    return u;
  }

  double step(double u) noexcept { return law_.step(u); }

 private:
  static constexpr std::size_t kPlays = 12;
  std::array<double, kPlays> halves_;  // CO units, at full severity
  PlaysLaw<double, kPlays> law_{};
};

}  // namespace loopwarden::effects
