// SPDX-License-Identifier: Apache-2.0
// Decides whether the controller output turns by travel (a valve) or by time (an external
// oscillation). Equations: docs/math/valve-evidence.md.
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
