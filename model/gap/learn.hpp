// SPDX-License-Identifier: Apache-2.0
// Where no name fits: the missing piece itself, as the effect `learned`
// (model/effects/learned/learned.hpp).
//
//   PV = PV of the model + sum of c_j (PV's answer to b_j) ,   b_j laws of the flow u:
//
//   static        hats over the openings that occurred     hysteretic   u, plays of u, a constant
//   dynamic       u, u through 1 to 3 equal lags           gain_profile u times hats over the time
//
// All are linear in c, which are solved for by least squares on the first two thirds, the free
// run's error being what is made small. Forms, sizes and the one or two numbers that a form is not
// linear in are chosen by what they leave on blocks left out; of those that leave about as little
// the one of fewest numbers is taken.
//
// What it can't do: what depends on nothing measured has no form here. It says what differs, not
// why; several causes together are one table.
//
// Sources: Stone, J. Royal Statistical Society B 36 (1974) 111-147 (cross-validation); those of
// learned.hpp.
#pragma once

#include <optional>
#include <vector>

#include "model/gap/check.hpp"
#include "model/gap/fit.hpp"

namespace loopwarden::gap {

// Of one block of the fitted part, PV units squared: sums of squares.
struct LearnedBlock {
  SampleRange range;
  double samples = 0.0;  // that count
  double model = 0.0;    // left by the model alone
  double learned = 0.0;  // left by the law when the block is left out
};

struct Learned {
  effects::EffectSpec spec;  // with its description
  effects::Block block = effects::Block::valve;
  double closed = 0.0;  // share of the gap on the blocks left out
  std::vector<LearnedBlock> blocks{};
};

// Beside `base`, the model within its uncertainty. Nothing where no form closes half of the gap.
std::optional<Learned> learn(const FreeRun& run, const Fit& base, const CheckedRecord& record);

// Whether the law does so much better on blocks left out than names do that were fitted to all of
// them, that these are not given. `left_by_names`: PV units, measured minus simulated.
bool ousts(const Learned& learned, const std::vector<double>& left_by_names,
           const std::vector<bool>& counts, double noise_rms);

}  // namespace loopwarden::gap
