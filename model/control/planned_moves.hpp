// SPDX-License-Identifier: Apache-2.0
// Has CO of a sticking valve held until, by a model of the loop, a move pays (kind
// `planned_moves`). Then the stem gets one move, after which PV settles near SP.
//
// Each step takes the sample of a period and returns a request. MoveHold carries it out on the
// real-time path, in one of the following periods.
//
// Phases: watching (PI controls; the cycles of the loop are measured), probing, resting, backing
// off, moving, disengaged.
//
// `shadow`: the moves are made on a model of valve and process in parallel; CO is not changed.
// `read_back` false: the stem is taken from the law of stiction.
//
// Parts: LoopEstimator (stem, friction, disturbance), CycleStatistics and BenefitMonitor (with and
// without planned moves), MovePlanner, MoveBudget, FrictionProbe, MoveSequence, ResponseCheck.
//
// Limits: self-regulating processes with one lag. A loop that does not cycle stays under PI. A slip
// jump within the read-back's noise is not seen. Without a read-back the actuator's lag must be
// given. No call reads a clock, allocates, locks or throws.
//
// Equations, thresholds and sources: docs/math/planned-moves.md.
// Figures: docs/explanation/accuracy.md.
#pragma once

#include <cstdint>

#include "model/control/benefit_monitor.hpp"
#include "model/control/compensator_contract.hpp"
#include "model/control/cycle_statistics.hpp"
#include "model/control/friction_probe.hpp"
#include "model/control/held_output.hpp"
#include "model/control/loop_estimator.hpp"
#include "model/control/move_budget.hpp"
#include "model/control/move_hold.hpp"
#include "model/control/move_planner.hpp"
#include "model/control/move_sequence.hpp"
#include "model/control/planned_moves_settings.hpp"
#include "model/control/response_check.hpp"

namespace loopwarden::control {

class PlannedMoves {
 public:
  // `period_s` > 0.
  PlannedMoves(const PlannedMovesSettings& settings, bool shadow, double period_s) noexcept;

  // Steps one period. Returns action, output, band and reason of the request.
  MovesRequest step(const MovesSample& sample) noexcept;
  // Counts the moves of the last hour that `before` made.
  void continue_hour(const PlannedMoves& before) noexcept;
  // A shadow begins to act, with its estimates and its baseline.
  void act() noexcept;
  MovesState state() const noexcept;

 private:
  // Time, and the time at which the loop has settled after the last change of the set point.
  struct SetPointWatch {
    double now_s = 0.0;
    double set_point = 0.0;  // PV units, the last that counted as a change
    double settled_at_s = 0.0;
    bool settled() const noexcept { return now_s >= settled_at_s; }
  };
  struct Disengagement {
    DisengageReason reason = DisengageReason::none;
    std::uint32_t count = 0;
    double watch_at_s = 0.0;  // when the loop is watched again
  };
  // Tasks of the next steps.
  struct Pending {
    bool engage = false;  // as soon as a probe costs little
    bool resume = false;  // the same, after the controller followed a set point
    bool hold = false;    // the controller is to hold its present CO
  };

  bool is_active() const noexcept {
    return phase_ != MovePhase::watching && phase_ != MovePhase::disengaged;
  }
  const Stem& stem() const noexcept { return loop_.stem(is_active()); }
  double settle_s() const noexcept;
  double commanded(const CompensatorInputs& in) const noexcept;
  MovesRequest request(const CompensatorInputs& in) const noexcept;
  PlanningState planning_state() const noexcept;
  bool may_probe() const noexcept;

  void follow_set_point() noexcept;
  void watch() noexcept;
  void watch_again() noexcept;
  void await_hold(const MovesSample& sample) noexcept;
  void take_over(const MovesSample& sample) noexcept;
  void engage() noexcept;
  void resume() noexcept;
  void disengage(DisengageReason reason) noexcept;
  void hand_over() noexcept;

  void control(const CompensatorInputs& in, bool in_effect) noexcept;
  void supervise() noexcept;
  void interrupt(const CompensatorInputs& in) noexcept;
  void begin_probe() noexcept;
  void probe() noexcept;
  void rest(const CompensatorInputs& in) noexcept;
  void decide(const CompensatorInputs& in, bool waits) noexcept;
  void judge_response() noexcept;
  void plan(double error) noexcept;
  void back_off() noexcept;
  void move(const CompensatorInputs& in) noexcept;
  void fail_stroke() noexcept;
  void finish_move(double applied) noexcept;

  PlannedMovesSettings settings_;
  double period_s_;
  LoopEstimator loop_;
  CycleStatistics cycles_;
  LoopBaseline baseline_;
  BenefitMonitor benefit_;
  MovePlanner planner_;
  MoveBudget budget_;
  FrictionProbe probe_;
  MoveSequence sequence_;
  ResponseCheck response_;
  HeldOutput held_;
  SetPointWatch watch_;
  MovePhase phase_ = MovePhase::watching;
  Disengagement disengagement_;
  Pending pending_;
  double rested_s_ = 0.0;           // since the last move
  double controller_before_ = 0.0;  // CO units, the controller's output one period ago
  std::uint32_t moves_ = 0;         // since the last engagement
};

}  // namespace loopwarden::control
