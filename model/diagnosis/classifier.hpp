// SPDX-License-Identifier: Apache-2.0
// Weighs the causes of an oscillation if the valve is not the cause (decision.hpp decides that):
// tuning, disturbance or saturation.
//
// Boosted trees with one score per cause and the probabilities from the scores,
//
//   score_c = base_c + sum over the trees of cause c of the leaf that the features fall into
//   p_c     = exp(score_c) / sum exp(score)
//
// fitted by steps along the gradient of the log-likelihood (J. H. Friedman, Annals of Statistics
// 29, 2001) to simulated loops. `loopwarden-study diagnose --train` writes the table,
// classifier.table, only from simulated loops.
//
// Limits: a loop unlike all simulated loops gets a probability like that of the nearest simulated
// one.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "model/diagnosis/features.hpp"

namespace loopwarden::diagnosis {

// The cause of a loop's trouble. The order is that of the table.
// Gates and rules name the causes after saturation; the table doesn't weigh them.
enum class Cause : std::uint8_t {
  none,
  stiction,
  backlash,
  tuning,
  disturbance,
  saturation,
  sensor,
  master_loop,
  no_flow,
  neighbour  // named by the survey, which has the other loops (diagnosis/neighbour.hpp)
};
inline constexpr std::size_t kCauseCount = 6;  // of the table
const char* to_text(Cause cause) noexcept;

using CauseProbabilities = std::array<double, kCauseCount>;

// A complete tree of three levels: node 0, then 1 and 2, then 3 to 6. The left branch is for
// features up to the threshold.
struct Tree {
  std::array<std::uint8_t, 7> feature{};
  std::array<float, 7> threshold{};
  std::array<float, 8> leaf{};
};

// Round by round, one tree per cause.
struct TreeTable {
  std::array<float, kCauseCount> base{};
  std::span<const Tree> trees;
};

CauseProbabilities weigh(const TreeTable& table, const Features& features);
std::size_t leaf_of(const Tree& tree, const Features& features);
// The table of this build, from classifier.table.
extern const TreeTable kTreeTable;
CauseProbabilities weigh(const Features& features);

}  // namespace loopwarden::diagnosis
