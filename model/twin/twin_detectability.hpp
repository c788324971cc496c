// SPDX-License-Identifier: Apache-2.0
// What the twin's watches would see on this loop: the twin is run with each change of each size,
// with its own noise, load and set-point moves, beside itself, and the change begins after kBefore
// answers.
//
//   gain, controller  the process gain; the controller's gains: times 1 + size
//   dead_time, lag    longer by size times the loop's answer; another lag of as much
//   least size        of kSizes, found by bisection, at which the alarm comes within kWithin_s in all but one of kRuns runs
//   time to alarm     at that size, median of the runs, s
//
// The controller's gains differ from the beginning on; where its watch can't judge it, nothing is
// said of it.
//
// Errors: effects::EffectError for a twin that can't be stepped.
// What it can't do: changes that the twin's own moves never touch; a size whose alarm is no surer
// than a smaller one's.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "model/numeric/parallel.hpp"
#include "model/plant/loop_model.hpp"

namespace loopwarden::twin {

enum class TwinSees : std::uint8_t { gain, dead_time, lag, controller };
const char* to_text(TwinSees change) noexcept;

struct TwinSeen {
  static constexpr std::array kSizes{0.05, 0.1, 0.15, 0.2, 0.3, 0.5, 1.0};
  static constexpr std::size_t kRuns = 5;
  static constexpr double kWithin_s = 2400.0;

  TwinSees change = TwinSees::gain;
  std::optional<double> size{};        // of gains a share, else s; none: no size of the grid
  std::optional<double> to_alarm_s{};  // with the size
};

// One for each that is watched. Results don't depend on the number of threads.
std::vector<TwinSeen> look_by_twin(const plant::LoopModel& twin, std::uint64_t seed,
                                   const numeric::ParallelFor& parallel);

}  // namespace loopwarden::twin
