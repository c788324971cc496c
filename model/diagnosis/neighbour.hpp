// SPDX-License-Identifier: Apache-2.0
// Detects whether one of two loops with a common time base pushes the other, by sudden moves or by
// order in time. Equations and sources: docs/math/neighbours.md.
//
// No errors. Too few samples, or signals without moves, give no push.
// Limits: it can't distinguish a source from a third loop or a load that reaches both in this
// order. It misses a push that is too slow to exceed the loops' own noise. It finds no source if
// both loops swing without noise, or if valve and victim answer in one sample without a jump.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "model/diagnosis/diagnosis.hpp"

namespace loopwarden::diagnosis {

// The moves of a loop for a comparison.
struct LoopMoves {
  std::vector<double> pv, co;      // about their mean over their deviation; NaN: missing
  std::vector<double> unforeseen;  // e; 0 if unknown
  std::vector<double> sudden;      // f
  std::vector<std::size_t> jumps;  // samples
  double jump_size = 0.0;          // rms of f at the jumps, or the least size of a jump
  double sudden_share = 0.0;       // deviation of PV is this times f's measure
};
LoopMoves moves_of(std::span<const double> pv, std::span<const double> co);

struct Push {
  bool by_jumps = false;
  double size = 0.0;  // by jumps: median move over the deviation of PV; by order: gain

  // Returns whether the push explains most of the victim's moves.
  bool main() const noexcept { return size >= (by_jumps ? 0.5 : 0.25); }
};
// Returns the push of `source` on `victim`, if any. Both have one length, with equal times sample
// by sample.
std::optional<Push> push(const LoopMoves& source, bool valve_effect, const LoopMoves& victim);

// Returns pairs to check, each once: all if there are at most `most`. Otherwise the `most` with the
// best correlation of their summed moves, and as many of those with the nearest period (within
// 4 %).
struct NeighbourLoop {
  std::vector<float> summed;  // unforeseen moves over four samples each, of length 1 together
  double period_s = 0.0;      // 0: does not swing
};
std::vector<float> summed_moves(const LoopMoves& loop);
std::vector<std::pair<std::size_t, std::size_t>> pairs_to_look_at(
    std::span<const NeighbourLoop> loops, std::size_t most);

// Returns whether a neighbour replaces the cause. It never excludes a valve fault. It replaces an
// unknown load. It replaces the controller's tuning and a steady loop only if it is the main cause.
bool neighbour_is_cause(diagnosis::DiagnosisVerdict verdict, diagnosis::Cause cause,
                        bool main) noexcept;

}  // namespace loopwarden::diagnosis
