// SPDX-License-Identifier: Apache-2.0
// Holds the compensator of a loop. The stickband jacket, which acts inside the integrator, is a
// separate part of LoopController.
//
// The header of each compensator describes it. No call allocates, locks or throws. The kind changes
// only in configure(). The correction is held within +-limit. Switching a compensator on or off, or
// changing it, does not move the output: the integral takes over what the compensator had added.
#pragma once

#include <variant>

#include "model/control/backlash_compensator.hpp"
#include "model/control/compensator_contract.hpp"
#include "model/control/hysteresis_inverse.hpp"
#include "model/control/knocker.hpp"
#include "model/control/move_hold.hpp"
#include "model/control/reinforcement.hpp"
#include "model/control/two_move.hpp"
#include "model/numeric/enum_name.hpp"

namespace loopwarden::control {

constexpr const char* to_text(CompensatorKind kind) noexcept {
  return numeric::enum_name<CompensatorKind::planned_moves>(
      kind,
      {"none", "knocker", "two_move", "reinforcement", "backlash", "hysteresis", "planned_moves"});
}

class Compensator {
 public:
  Compensator(const CompensatorSettings& settings, double period_s) noexcept;

  // Resets at the next step, except for planned moves that were in shadow and are to act.
  void configure(const CompensatorSettings& settings) noexcept;
  // The next step starts from the controller's output of that time.
  void reset() noexcept { fresh_ = true; }

  // Steps one period. Returns the correction, acting or in shadow (see settings().shadow).
  // `request`: of planned moves.
  Correction step(const CompensatorInputs& in, const MovesRequest& request = {}) noexcept;

  const CompensatorSettings& settings() const noexcept { return settings_; }
  // Null if the compensator is of another kind, or was not stepped since the last reset.
  const MoveHold* hold() const noexcept {
    return settings_.kind == CompensatorKind::planned_moves && !fresh_ ? &hold_ : nullptr;
  }

 private:
  struct None {
    void reset(double) noexcept {}
    Correction step(const CompensatorInputs&) noexcept { return {}; }
  };
  using Law =
      std::variant<None, Knocker, TwoMove, Reinforcement, BacklashCompensator, HysteresisInverse>;
  static Law law_of(const CompensatorSettings& settings, double period_s) noexcept;

  CompensatorSettings settings_;
  double period_s_;
  Law law_;  // None for planned moves
  MoveHold hold_;
  bool fresh_ = true;
};

}  // namespace loopwarden::control
