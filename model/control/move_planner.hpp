// SPDX-License-Identifier: Apache-2.0
// Decides from which expected offset a move pays, and plans the move.
//
// The threshold h and the offset m that a move leaves on purpose minimise the expected cost of
// variance and stem travel: 60 values of h times 4 of m, one h per call of search().
// docs/math/planned-moves.md has the cost. No call allocates or throws.
#pragma once

#include <cstdint>

#include "model/control/cycle_statistics.hpp"
#include "model/control/output_limiter.hpp"
#include "model/control/planned_moves_limits.hpp"
#include "model/control/planned_moves_settings.hpp"
#include "model/control/valve_friction.hpp"

namespace loopwarden::control {

// The loop at the moment, as a plan needs it.
struct PlanningState {
  LoopBaseline baseline{};
  double s = 0.0;           // CO units
  double j = 0.0;           // CO units
  double settle_s = 0.0;    // from the end of a stroke until the read-back is steady
  double rate_per_s = 0.0;  // CO units/s, of the output
  double allowance = 0.0;   // PV units^2 s of squared error that a move may cost
};

// One stroke to `target`, or a first stroke to `first_target` before it.
struct MovePlan {
  bool possible = false;
  bool direct = false;        // in one stroke
  double target = 0.0;        // CO units, stem
  double first_target = 0.0;  // CO units, stem: end of the first stroke
  double first_output = 0.0;  // CO units, CO of the first stroke
};

class MovePlanner {
 public:
  explicit MovePlanner(const PlannedMovesSettings& settings) noexcept;

  // Planned moves engage; `j`: CO units.
  void restart(double j) noexcept;
  void pass(double period_s) noexcept { since_plan_s_ += period_s; }

  // Tries one threshold. Returns false if no threshold leaves the error small enough.
  bool search(const PlanningState& loop) noexcept;
  double threshold() const noexcept { return chosen_.threshold; }  // h, PV units
  // Expected offset from which a move pays, PV units. `variance`: of the disturbance's estimate.
  // `strain`: factor on h.
  double action_threshold(double variance, double strain = 1.0) const noexcept;

  bool is_new_set_point(double set_point) const noexcept;
  // From now on `set_point` is no new one.
  void follow(double set_point) noexcept { planned_for_ = set_point; }

  // Plans a move from `position` for an expected offset of `error`, PV units. `detour_allowed`: the
  // budget allows two moves. Not possible: no move of at most max_move within the limits does it.
  MovePlan plan(double error, double position, const PlanningState& loop,
                const OutputLimits& limits, const ValveFriction& friction, bool seen,
                bool detour_allowed) const noexcept;
  // The planned move begins.
  void begin(double error, double set_point) noexcept;
  bool follows_set_point() const noexcept { return follows_set_point_; }
  // A move has ended `missed` CO units from its target.
  void learn_landing(double missed) noexcept;

 private:
  struct Threshold {
    double threshold = 0.0;  // h, PV units
    double margin = 0.0;     // m, PV units
    double variance = 0.0;   // of SP - PV, PV units^2
    double cost = PlannedMovesLimits::kNever;
  };
  double walk(double j) const noexcept;
  double pulse(double detour, double error, const PlanningState& loop) const noexcept;

  PlannedMovesSettings settings_;
  std::uint32_t candidate_ = 0;
  Threshold best_;
  Threshold chosen_;
  double landing_variance_;   // CO units^2
  double passed_room_ = 0.0;  // h^2 - m^2 of the moves so far, forgetting
  double passed_s_ = 0.0;     // time that they took
  double since_plan_s_ = 0.0;
  double planned_for_ = 0.0;  // SP of the last plan
  bool follows_set_point_ = false;
};

}  // namespace loopwarden::control
