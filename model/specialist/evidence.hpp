// SPDX-License-Identifier: Apache-2.0
// What the explanations of a window amount to, as one list of numbers that the specialists' networks read.
//
// Misfits as logarithms over the noise and over each other, sizes as logarithms, offsets of the belief in
// standard deviations, movement over noise: nothing depends on units, and all of it is bounded.
#pragma once

#include <array>
#include <cstddef>

#include "model/specialist/explainer.hpp"

namespace loopwarden::specialist {

inline constexpr std::size_t kEvidence = 53;
using Evidence = std::array<double, kEvidence>;

// `findings` must be usable.
Evidence evidence_of(const Findings& findings) noexcept;

}  // namespace loopwarden::specialist
