// SPDX-License-Identifier: Apache-2.0
// Of two loops of one time base: does the one push the other?
//
//   z(k) = sum_{l=1..6} a_l pv(k - l) + b_l co(k - l) + e(k)       what a loop's own past and its own CO foretell, and the rest
//   f(k) = e(k) + e(k + 1) + e(k + 2)                              sudden moves, over the median of |f| x 1.48
//   jump   a largest |f| within 3 samples either way, above 5
//
//   pv, co   of one loop, about their mean over their deviation    l   lag, samples
//
// By jumps, of a source whose valve shows an effect: at those of its jumps at which the victim moves less, each in
// its own measure, the victim moves one way with them,
//
//   S = |sum sign(f_source) min(1, max(-1, f_victim / 3))| / sqrt(jumps)     at least 1.5, and more than at any other shift
//
// and by at least a tenth of the deviation of its PV in the median. Loops on one header answer within a sample, so no
// order tells them apart: who jumped is the one that moved far, since each of its jumps moves the others by a part.
//
// By order, of any source: pv of the victim is foretold one step ahead from its own past and CO with and without pv
// and co of the source 2 to 5 samples ago; each fourth of the record by what the other three teach,
//
//   gain = 1 - sum of squares with / without        at least 0.1, in each fourth 0.05
//
// more than at each of 20 shifts, more than the squared correlation of the two e within a sample (what moves both at
// once, or by clocks that differ by a sample, is no order) and four times the gain the other way round.
//
// Shifts turn the source by a tenth to nine tenths of the record: what is left of slow trends and of like periods counts
// there too.
//
// Sources: C. W. J. Granger, Econometrica 37 (1969) 424-438 (gain); L. D. Haugh, J. Am. Stat. Assoc. 71 (1976) 378-385
// (moves after the own past is taken out); T. Yuan and S. J. Qin, J. Process Control 24 (2014) 450-459, and M. Bauer et
// al., IEEE Trans. Control Systems Technology 15 (2007) 12-21 (the same question of a whole plant).
// No errors. Too few samples, or signals without moves, give no push.
// Limits: it can't tell a source from a third loop or a load that reaches both in this order; see a push that takes longer than
// the loops' own noise hides; tell who pushes where both swing without noise, or where valve and victim answer in one sample and
// no jump shows.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "model/diagnosis/diagnosis.hpp"

namespace loopwarden::survey {

// What is compared of a loop.
struct LoopMoves {
  std::vector<double> pv, co;      // about their mean over their deviation; NaN: missing
  std::vector<double> unforeseen;  // e; 0 where not known
  std::vector<double> sudden;      // f
  std::vector<std::size_t> jumps;  // samples
  double jump_size = 0.0;          // rms of f at the jumps, or what a jump is at the least
  double sudden_share = 0.0;       // deviation of PV is this times f's measure
};
LoopMoves moves_of(std::span<const double> pv, std::span<const double> co);

struct Push {
  bool by_jumps = false;
  double size = 0.0;  // by jumps: median move over the deviation of PV; by order: gain

  // Most of what the victim moves.
  bool main() const noexcept { return size >= (by_jumps ? 0.5 : 0.25); }
};
// Both of one length, sample by sample of one time.
std::optional<Push> push(const LoopMoves& source, bool valve_effect, const LoopMoves& victim);

// Pairs worth a look, each once: all where there are at most `most`; else the `most` with the best correlation of their
// summed moves and as many of those with the nearest period (within 4 %).
struct NeighbourLoop {
  std::vector<float> summed;  // unforeseen moves over four samples each, of length 1 together
  double period_s = 0.0;      // 0: does not swing
};
std::vector<float> summed_moves(const LoopMoves& loop);
std::vector<std::pair<std::size_t, std::size_t>> pairs_to_look_at(
    std::span<const NeighbourLoop> loops, std::size_t most);

// A neighbour never acquits a valve, and takes the place of a load that nobody named; of the controller's tuning and of
// a calm loop only where it is the main thing.
bool neighbour_is_cause(diagnosis::DiagnosisVerdict verdict, diagnosis::Cause cause,
                        bool main) noexcept;

}  // namespace loopwarden::survey
