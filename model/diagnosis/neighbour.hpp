// SPDX-License-Identifier: Apache-2.0
// Detects whether one of two loops with a common time base pushes the other.
//
//   z(k) = sum_{l=1..6} a_l pv(k - l) + b_l co(k - l) + e(k)
//          prediction from a loop's own past and CO, with the error e
//   f(k) = e(k) + e(k + 1) + e(k + 2)
//          sudden moves, over the median of |f| x 1.48
//   jump   a largest |f| within 3 samples either way, above 5
//
//   pv, co   of one loop, about their mean over their deviation    l   lag, samples
//
// By jumps, for a source whose valve shows an effect. Only jumps of the source count at which the
// victim moves less, each in its own measure. At these jumps the victim moves in one direction,
//
//   S = |sum sign(f_source) min(1, max(-1, f_victim / 3))| / sqrt(jumps)
//       at least 1.5, and more than at any other shift
//
// and by at least a tenth of the deviation of its PV in the median. Loops on one header answer
// within a sample, so the order doesn't separate them. The loop that moved far is the source, since
// each of its jumps moves the others by a part.
//
// By order, for any source: pv of the victim is predicted one step ahead from its own past and CO.
// This is done with and without pv and co of the source 2 to 5 samples ago. Each fourth of the
// record is predicted with the coefficients of the other three,
//
//   gain = 1 - sum of squares with / without        at least 0.1, in each fourth 0.05
//
// The gain must exceed three values: that at each of 20 shifts; the squared correlation of the two
// e within a sample (a common cause, or clocks that differ by a sample, gives no order); four times
// the gain in the other direction.
//
// Shifts turn the source by a tenth to nine tenths of the record. Remaining slow trends and similar
// periods have the same effect there.
//
// Sources: C. W. J. Granger, Econometrica 37 (1969) 424-438 (gain); L. D. Haugh, J. Am. Stat.
// Assoc. 71 (1976) 378-385 (moves without the own past); T. Yuan and S. J. Qin, J. Process Control
// 24 (2014) 450-459, and M. Bauer et al., IEEE Trans. Control Systems Technology 15 (2007) 12-21
// (the same question for a whole plant).
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
