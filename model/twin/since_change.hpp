// SPDX-License-Identifier: Apache-2.0
// What a loop's twin lacks since a moment that is known within bounds: a competition of single
// changes, and of two, each the twin with one effect from a moment on, its own within the bounds or
// up to kUnseen_s before them (a change shows where the stem, or SP, moves), and the same law
// before and after.
//
//   r(k) = PV(k) - PV of the twin with the change under the measured CO       PV units
//   e(k) = r(k) - d(k),  d <- d + K e    K of a load of twice the twin's intensity; it counts from kUnseen_s before the
//            earliest moment on, of a record that begins later than twice that before it from half way on
//   s^2    mean of e^2 before that
//   rho(e) = b log(1 + e^2/b),  b = (kBound s)^2   the error as it counts: a slip that comes too late, or not at all, outweighs
//            no more than others that are right
//   closed = 1 - (sum e^2 - N s^2)/(the same of the twin alone), over the last third of what comes after the earliest moment:
//            nothing was fitted to it, but it took part in the choice among what was; where the twin alone leaves next to
//            no more than noise there, over all that counts, of which the most was fitted
//   t      mean over sd/sqrt(B) of a rival's sum of rho less the winner's, over B blocks
//   from   the moments at which the winner, all else kept, leaves less than kHardlyMore s^2 more
//
// What is fitted to the first two thirds of what comes after the earliest moment wins by the least
// sum of rho over all; of those that the blocks can't tell apart (t below kAlike) the plainest is
// chosen, in the order of kinds(): gain, dead time, lag, step, drift, oscillation, then the
// valve's; the others are its alternatives. A second change is taken in where it halves what is
// left, by blocks too, and closes kOfGap of the gap. Confidence is that of t against the nearest
// rival that is no alternative, at most kMostSure, and less where not all is closed.
//
// The search. A friction a little too large misses a slip, and no descent finds that: of the
// valve's changes sizes kFinely apart are tried on kNear_s of the record, and the search goes on
// from the best of them on twice as much each time; of one that slips from the kFollowed best, of
// which all of the record decides.
//
// The interval of a valve effect's parameter, the others as found, ends where the blocks tell
// another value from the found one (t above 1.96), of values 2, 4, 8 ... % off; or a factor of 2.3
// away.
//
// Errors: none: an empty result where nothing closes kLeastClosed.
// What it can't do: a change that began earlier than kUnseen_s before the bounds; more than two
// changes, or two at different moments; effects that are none of kinds(): those are the gap
// workflow's.
//
// Sources: Ljung, System Identification (1999), ch. 7 (prediction errors); Diebold and Mariano, J.
// Bus. Econ. Stat. 13 (1995) 253-263 (a test of two predictions); Huber, Robust Statistics (1981),
// ch. 7 (bounded errors; the form is Cauchy's).
#pragma once

#include <vector>

#include "model/gap/record.hpp"
#include "model/gap/result.hpp"
#include "model/numeric/parallel.hpp"

namespace loopwarden::twin {

// Of the record's samples.
struct ChangeMoment {
  std::size_t earliest = 0;
  std::size_t likeliest = 0;  // no change began behind it
};

struct SinceChange {
  std::vector<gap::FoundEffect> effects{};  // one or two
  std::size_t at = 0;                       // sample at which it began
  gap::SampleRange from{};                  // at which it may have begun, both ends
  double closed = gap::kNone;
  plant::LoopModel corrected{};  // with them for good
};

// Before the change the loop was the twin's.
SinceChange since_change(const numeric::LoopRecord& record, ChangeMoment change,
                         const plant::LoopModel& twin, const numeric::ParallelFor& parallel);

}  // namespace loopwarden::twin
