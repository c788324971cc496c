// SPDX-License-Identifier: Apache-2.0
// Collects the inputs of the five condition indices (model/analysis/condition_index.hpp) of a
// running loop.
//
// Cycles are counted in intervals of one window's length, in every mode. An index shows the newest
// full one:
//   read-back bad   share of its cycles without a good read-back, once one has been there
//   PV bad          share of its cycles with a bad PV
//   cycle bad       share of its cycles that were late, missing, or whose command did not reach the
//                   device
//   deviation       mean |CO - stem|, % of the CO span
//   lag             s: sum of (mean of CO - stem) (move of the stem) over sum of (move)^2, times
//                   the length of a block, over the blocks of a 24th of a window in which the stem
//                   moves by more than the resolution. Exact for a first-order lag with CO at any
//                   course.
// Windows add the RMS of SP - PV and the stick band. The stick band is the larger of two values:
// the one from the read-back, and the severity of an active stiction, backlash or hysteresis alarm.
// Without an active alarm the index is unknown, because a fault that the movement doesn't reach
// leaves no trace.
//
// The stick from the ellipse of PV and CO is not used. It includes the lag of the process and would
// blame the valve of every loop with tight tuning. Travel since overhaul is not available here. An
// alarm counts for as long as it is active.
//
// A window may have begun long before a verdict changed: with a sample time of 1 s it is 16 min
// long. Its measures of the stem are unknown until a window and an interval are wholly after the
// change. A change that a window itself causes counts from that window on.
//
// Stepped by the caller; no clock, no allocation.
// No errors. Unknown values stay NaN.
// Limits: it can't separate backlash from lag (a stem that follows with backlash at constant speed
// looks late by backlash/speed); see a lag while the stem rests.
#pragma once

#include <cstdint>

#include "model/analysis/condition_index.hpp"
#include "model/alarm/loop_alarms.hpp"
#include "model/watch/window_builder.hpp"
#include "model/alarm/window_measures.hpp"

namespace loopwarden::watch {

class ConditionWatch {
 public:
  explicit ConditionWatch(const WindowSettings& settings) noexcept;

  struct Troubles {
    bool pv_bad = false;     // worse than uncertain
    bool pv_frozen = false;  // does not change although CO moves
    bool cycle_bad = false;  // late, or the command did not reach the device
  };
  void add(const Cycle& cycle, const Troubles& troubles) noexcept;
  // Adds a window that ends with the newest cycle. `conditions`: of a judged window, otherwise
  // null.
  void window(const alarm::WindowMeasures& measures,
              const alarm::AlarmConditions* conditions) noexcept;
  // Sets the conditions from routine evidence or a twin. Returns true if the verdict has changed.
  bool verdict(const alarm::AlarmConditions& conditions) noexcept;
  // Returns the measures of a window that ends with the newest cycle. They lack the stick if the
  // window began before the last change of verdict.
  alarm::WindowMeasures told(alarm::WindowMeasures measures) const noexcept;

  // No index is known while PV is frozen, because its samples do not show valve and loop.
  analysis::ConditionIndices indices() const noexcept {
    return pv_frozen_ ? analysis::ConditionIndices{} : analysis::condition_indices(inputs_);
  }
  const analysis::ConditionInputs& inputs() const noexcept { return inputs_; }

 private:
  // Sums over the interval in progress.
  struct Sums {
    std::uint64_t cycles = 0;  // missing ones included
    std::uint64_t pv_bad = 0;
    std::uint64_t cycle_bad = 0;
    std::uint64_t read_back_bad = 0;
    std::uint64_t compared = 0;  // with a CO and a stem
    double deviation = 0.0;      // CO units
    double error_by_move = 0.0;  // CO units squared
    double move_squared = 0.0;
  };
  void follow(double co, double stem) noexcept;
  void close() noexcept;
  void count_alarms() noexcept;

  double co_span_;        // CO units
  double sample_time_s_;  // s, of a cycle
  double resolution_;     // CO units
  std::uint64_t length_;  // cycles of an interval
  std::uint64_t block_;   // cycles of a block
  Sums sums_;
  std::uint64_t in_block_ = 0;
  double block_start_ = 0.0;  // CO units, stem
  double block_error_ = 0.0;  // CO units, sum of CO - stem
  double last_error_ = 0.0;   // CO units
  std::uint64_t last_period_ = 0;
  std::uint64_t changed_ = 0;    // first cycle after the last change of verdict; 0: no change yet
  bool any_ = false;             // a cycle has been seen
  bool read_back_seen_ = false;  // and a read-back
  bool pv_frozen_ = false;       // by the newest cycle
  alarm::AlarmConditions conditions_{};  // the newest
  analysis::ConditionInputs inputs_;
};

}  // namespace loopwarden::watch
