// SPDX-License-Identifier: Apache-2.0
// Carries out a planned move: one stroke, or a first stroke and then the one to the target.
//
// A stroke sets CO and waits for the stem. A stem that does not move is pushed on slowly, by at
// most the stick band. Without a read-back a stroke ends by time. A loss of the read-back stops CO
// and the stroke's clock. No call allocates or throws.
#pragma once

#include <cstdint>
#include <limits>

#include "model/control/held_output.hpp"
#include "model/control/loop_estimator.hpp"
#include "model/control/move_planner.hpp"

namespace loopwarden::control {

enum class StrokeResult : std::uint8_t { under_way, arrived, stem_stuck };

class MoveSequence {
 public:
  MoveSequence(const PlannedMovesSettings& settings, bool shadow, double period_s) noexcept;

  // Planned moves take over with the stem at `position`.
  void take_over(double position) noexcept { from_ = to_ = position; }
  // They engage: failed strokes of before no longer count.
  void restart() noexcept;
  // A shadow begins to act on a stem that is read back (`seen`).
  void begin_acting(bool seen) noexcept;

  void begin(const MovePlan& plan, double position, const OutputLimits& limits,
             HeldOutput& held) noexcept;
  // Second stroke, to the target.
  void begin_second(const LoopEstimator& loop, HeldOutput& held) noexcept;
  // One period of the first of two strokes, and of the stroke to the target.
  StrokeResult step_first(const LoopEstimator& loop, HeldOutput& held) noexcept;
  StrokeResult step_last(const LoopEstimator& loop, HeldOutput& held) noexcept;
  // The stroke to the target has arrived.
  void succeed() noexcept { failed_ = 0; }
  // The stem did not move. Returns whether that happened too often in a row.
  bool fail() noexcept;

  // One period of rest.
  void rest() noexcept { since_failure_s_ += period_s_; }
  // The last stroke failed so recently that the stem may move late.
  bool may_be_late() const noexcept;
  // The stem has moved since that stroke, CO units from its start.
  bool moved_late(double position, double j) const noexcept;

  double from() const noexcept { return from_; }  // CO units, stem when the stroke began
  double to() const noexcept { return to_; }      // CO units, where the stroke is to end
  bool was_pushed() const noexcept { return pushed_ > 0.0; }
  // Time after a stroke until the read-back is steady; `sample_s`: interval of the read-back.
  double settle_s(double sample_s) const noexcept;

 private:
  void begin_stroke(double position, double to, double output, const OutputLimits& limits,
                    HeldOutput& held) noexcept;
  bool waits_for_read_back(const LoopEstimator& loop, HeldOutput& held) const noexcept;
  // The stem has been at rest for `samples` values, and for 0.7 of the time that it took.
  bool stands(const LoopEstimator& loop, double samples, double held_s) noexcept;
  double push(const LoopEstimator& loop) const noexcept;  // CO units per period

  double period_s_;
  double given_lag_s_;
  double response_s_;  // L + T
  double actuator_s_;  // estimate of the actuator's lag
  double target_ = 0.0;
  double from_ = 0.0;
  double to_ = 0.0;
  double pushed_ = 0.0;                                               // CO units in this stroke
  std::uint32_t failed_ = 0;                                          // strokes in a row
  double since_failure_s_ = std::numeric_limits<double>::infinity();  // at rest
};

}  // namespace loopwarden::control
