// SPDX-License-Identifier: Apache-2.0
// Jumps of the stem that PV shows, and a stem whose slips follow them.
//
// The friction of a real valve varies from slip to slip, so the moment of each slip is not a
// function of two parameters. A fit that takes every slip from its law misses one slip by chance
// and then follows another sequence. While fitting, the slips are therefore taken from PV:
//
//   x^(k) = (mean of y + T times slope of y) / K     over k - w ... k + w, shifted by the dead time
//   jump at k: |x^(k + 2w) - x^(k - 2w)| has a local maximum above max(6 deviations, 0.4 % of CO)
//   a resting stem slips at (1 - e) fs if PV shows a jump this way, at (1 + e) fs shortly before
//   such a jump, and otherwise at fs: PV does not show every jump
//   penalty  sum of (F - fs)^2 / (2 v)   over the slips at a force F that is not fs, nats
//   e = kLimits.early + 2 d / fs     v = (kLimits.friction_varies fs)^2 + d^2
//
//   x^  stem, CO units     y  PV     K, T  gain and time constant     w  window, samples
//   fs  static friction, CO units     d  standard deviation of the rounding of CO, CO units
//
// The law of the stem is that of effects/stiction/stiction_inertial.hpp.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "model/effects/stiction/stiction_inertial.hpp"
#include "model/estimator/blocks.hpp"
#include "model/estimator/hypothesis.hpp"

namespace loopwarden::estimator {

struct Slips {
  std::vector<std::int8_t> direction;  // of each sample near a jump: 1 opening, -1 closing, 0 none
  std::vector<std::int8_t> coming;     // of the jump that follows shortly
  std::size_t count = 0;               // jumps while CO hardly moves
  double static_friction = 0.0;        // CO units, median force before them
  double remaining = 0.0;              // median force after them over that before
  double rounding = 0.0;               // CO units, d
};

// From the first `samples` samples.
Slips find_slips(const Observed& observed, const LoopFacts& loop, std::size_t samples,
                 double noise_rms);

// Steps a stem whose slips follow those of PV, read `later` samples later. `stem` holds the force
// on input, in CO units, and the position on output. Returns the penalty, nats.
double follow_slips(effects::StictionInertial& law, double static_friction, const Slips& slips,
                    std::ptrdiff_t later, std::span<double> stem) noexcept;

}  // namespace loopwarden::estimator
