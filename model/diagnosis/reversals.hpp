// SPDX-License-Identifier: Apache-2.0
// Decides whether the controller output turns by travel or by time.
//
//   CO turns when it has gone back by kTurnDepth of its range (2 to 98 %)
//   travel_i    |CO(turn i+1) - CO(turn i)|; scatter of the moves up and of the moves down, each
//               the range from the 25 % to the 75 % quantile over the median, together as root of
//               the mean square
//   cycle_i     time from turn i to turn i+2; its scatter likewise; and that of the time over four
//               cycles, over the same median
//
// A sticking valve, or one with backlash, answers after CO has travelled its band, whatever time
// that takes, so the travel is steady. A load, a master, or a loop at the limit of stability
// determines the time, and the travel varies with its strength.
//
//   travel      the cycle scatters more than 1.5 times as much as the travel, and the travel by
//               less than 0.3: like a valve
//   time        the cycle scatters less than 0.4 and less than 1.1 times as much as the travel, in
//               eight turns or more: like an external oscillation. Less than 0.8 times if four
//               cycles scatter more than 1.5 times as much as one: noise scatters travel and time
//               of a valve's limit cycle alike, and the cycle forgets its phase
//   clockwork   the cycle scatters less than 0.06, and four of them hardly more than one, in 16
//               turns or more of all windows: an external oscillation sets the time.
//               A limit cycle forgets its phase, so its scatter grows with the root of the number
//               of cycles. A regular load under tight control can look like a sticking valve in all
//               other respects, so there is no verdict
//   neither     fewer than kLeastReversals reversals, or none of these
//
// Limits: it can't recognise a valve in a cycle that a steady load forces upon it (it reads as
// time).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace loopwarden::diagnosis {

enum class ReversalsBy : std::uint8_t { neither, travel, time, clockwork };
const char* to_text(ReversalsBy by) noexcept;

struct Reversals {
  std::size_t count = 0;        // without the first and the last of the record
  double travel_scatter = 0.0;  // 0 to about 2; 0 below kLeastReversals
  double cycle_scatter = 0.0;
  double four_cycle_scatter =
      0.0;  // of the median cycle; 0 if the record has fewer than kLeastFours
  ReversalsBy by() const noexcept;
  bool cycles() const noexcept;  // turns by travel, or the cycle scatters less than 0.4
};

// Returns the turns of `co`, which has no slow movement and 4 to 40 samples per cycle.
Reversals find_reversals(std::span<const double> co);

// Returns the samples at which x turns. A turn counts when x has gone back by `depth`.
std::vector<std::size_t> turning_points(std::span<const double> x, double depth);

}  // namespace loopwarden::diagnosis
