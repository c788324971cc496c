// SPDX-License-Identifier: Apache-2.0
// The compensator of a loop: none, or one of those that add to CO. The stickband jacket, which acts inside
// the integrator, stands beside it in LoopController.
//
// Each is written down in the header of its name. None allocates, locks or throws; which one it is changes
// only in configure(). The correction is held within +-limit. Switched on, changed or off, the output
// does not move by itself: the law's integral takes over what the compensator had added.
#pragma once

#include <variant>

#include "model/control/backlash_compensator.hpp"
#include "model/control/compensator_contract.hpp"
#include "model/control/hysteresis_inverse.hpp"
#include "model/control/knocker.hpp"
#include "model/control/planned_moves.hpp"
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

  // Starts afresh at the next step; planned moves that were in shadow and are to act go on with what they know.
  void configure(const CompensatorSettings& settings) noexcept;
  // The next step starts afresh from the law's output then.
  void reset() noexcept { fresh_ = true; }

  // One period: what is to be added, whether or not it is to act (see settings().shadow).
  Correction step(const CompensatorInputs& in) noexcept;

  const CompensatorSettings& settings() const noexcept { return settings_; }
  // None where it is of another kind.
  const PlannedMoves* planned_moves() const noexcept { return std::get_if<PlannedMoves>(&law_); }

 private:
  struct None {
    void reset(double) noexcept {}
    Correction step(const CompensatorInputs&) noexcept { return {}; }
  };
  using Law = std::variant<None, Knocker, TwoMove, Reinforcement, BacklashCompensator,
                           HysteresisInverse, PlannedMoves>;
  static Law law_of(const CompensatorSettings& settings, double period_s) noexcept;

  CompensatorSettings settings_;
  double period_s_;
  Law law_;
  bool fresh_ = true;
};

}  // namespace loopwarden::control
