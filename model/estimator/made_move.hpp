// SPDX-License-Identifier: Apache-2.0
// Finds the move of a planned test (plan.hpp) in a record, if a person has made it by hand.
//
// The moved signal (SP in automatic, the output in manual) is reduced to medians of blocks of a
// tenth of a hold, so that noise and single wrong samples don't count.
//
//   rest   r0: the newest median of half a hold whose blocks are all within kRests |size| of it
//   start  the first block with |r - r0| > kDeparts |size|
//   made   r0 is within |size| of the planned start, the largest distances from r0 to both sides
//          are those of the plan within kSize |size|, and with one pace c in [1 - kPace, 1 + kPace]
//          each block r(t) has a moment t' with |t' - t/c| <= kTime holds and
//          |r(t) - r0 - (p(t') - p(0))| <= kSize |size|          p: the plan, moved()
//   other  any other departure from rest
//
// Errors: none. A departure without rest before it is not seen. Up to kMissing of the blocks may be
// missing. Limits: moves are told apart only if the signal rests between them. A ramp that takes
// twice as long, and stairs of small steps, count as a drift and are not seen.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "model/estimator/plan.hpp"

namespace loopwarden::estimator {

// Tolerances. By hand: a person reads the size from a faceplate and the time from a clock.
struct MoveTolerance {
  static constexpr double kRests = 0.15;    // of the size
  static constexpr double kDeparts = 0.25;  // of the size; a step of stairs is 0.33
  static constexpr double kSize = 0.2;      // of the size
  static constexpr double kTime = 0.2;      // of a hold
  static constexpr double kPace = 0.2;      // of the duration
  static constexpr double kMissing = 0.2;   // of the blocks of the move
};

struct MadeMove {
  enum class State : std::uint8_t { none, under_way, other, made };
  // Of another move.
  enum class Difference : std::uint8_t { none, start, size, course, missing };
  State state = State::none;
  Difference difference = Difference::none;
  std::size_t begin = 0;  // first moved sample
  std::size_t end = 0;    // after the last sample; of a move under way: the end of the record
  double from = 0.0;      // before the move
  double size = 0.0;      // largest distance from `from` on the side of the planned size, signed
};
const char* to_text(MadeMove::Difference difference) noexcept;

// Returns the first move that was made as planned, otherwise the newest move. `from`: planned
// start. `value`: SP or output, in the units of the plan; NaN: missing, or the loop is in another
// mode.
MadeMove find_move(const Move& planned, double from, const std::vector<double>& value,
                   double period_s);

}  // namespace loopwarden::estimator
