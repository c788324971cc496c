// SPDX-License-Identifier: Apache-2.0
// Does the controller output turn by travel or by time?
//
//   CO turns where it has gone back by kTurnDepth of its range (2 to 98 %)
//   travel_i    |CO(turn i+1) - CO(turn i)|;  scatter of the moves up and of the moves down, each the range from the
//               25 % to the 75 % quantile over the median, together as root of the mean square
//   cycle_i     time from turn i to turn i+2; its scatter likewise; and that of the time over four cycles, over the same median
//
// A sticking valve, or one with play, answers after CO has travelled its band, whatever time that takes: the travel is the
// steady one. A load, a master, or a loop at the edge of stability sets the time, and the travel wanders with its strength.
//
//   travel      the cycle scatters more than 1.5 times as much as the travel, and the travel by less than 0.3: like a valve
//   time        the cycle scatters less than 0.4 and less than 1.1 times as much as the travel, in eight turns or more: like a
//               swing from elsewhere. Less than 0.8 times where four cycles scatter more than 1.5 times as much as one: noise
//               scatters travel and time of a valve's limit cycle alike, and it forgets its phase
//   clockwork   the cycle scatters less than 0.06, and four of them hardly more than one, in 16 turns or more of all windows:
//               something from outside keeps the time.
//               A limit cycle forgets its phase, its scatter grows with the root of the number of cycles. A regular load under
//               tight control can look like a sticking valve in all else, so nothing can be told
//   neither     fewer than kLeastTurns turns, or none of these
//
// Limits: it can't tell a valve in a cycle that a steady load forces upon it (it reads as time).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace loopwarden::diagnosis {

inline constexpr std::size_t kLeastTurns = 6;
inline constexpr std::size_t kLeastForTime = 8;
inline constexpr std::size_t kLeastForClockwork = 16;
inline constexpr std::size_t kLeastFours = 4;

enum class TurnsBy : std::uint8_t { neither, travel, time, clockwork };
const char* to_text(TurnsBy by) noexcept;

struct Turns {
  std::size_t count = 0;        // the first and the last of the record left out
  double travel_scatter = 0.0;  // 0 to about 2; 0 below kLeastTurns
  double cycle_scatter = 0.0;
  double four_cycle_scatter =
      0.0;  // of the median cycle; 0 where fewer than kLeastFours are in the record
  TurnsBy by() const noexcept;
  bool cycles() const noexcept;  // turns by travel, or the cycle scatters less than 0.4
};

// `co` without its slow movement, 4 to 40 samples a cycle.
Turns find_turns(std::span<const double> co);

// Samples at which x turns; a turn counts once x has gone back by `depth`.
std::vector<std::size_t> turning_points(std::span<const double> x, double depth);

}  // namespace loopwarden::diagnosis
