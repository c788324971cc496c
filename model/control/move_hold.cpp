// SPDX-License-Identifier: Apache-2.0
#include "model/control/move_hold.hpp"

#include <algorithm>
#include <cmath>

namespace loopwarden::control {

bool MoveHold::is_valid(const MovesRequest& request) const noexcept {
  return request.run == sample_.run && request.shadow == sample_.shadow &&
         sample_.number <= request.valid_until && std::isfinite(request.output);
}

Correction MoveHold::step(const CompensatorInputs& in, const MovesRequest& request,
                          const CompensatorSettings& settings) noexcept {
  // A hold in shadow is at a CO that the loop does not have.
  const bool held_before = sample_.holding && sample_.shadow == settings.shadow;
  const bool new_set_point = held_before && in.set_point != sample_.in.set_point;
  const double step = in.output - sample_.in.output;
  ++sample_.number;
  if (sample_.shadow != settings.shadow) disengaged_ = DisengageReason::none;
  sample_.shadow = settings.shadow;
  sample_.settings = settings.planned;
  sample_.in = in;

  const bool valid = is_valid(request);
  if (valid) disengaged_ = request.disengaged;
  const bool begins = request.action == HoldAction::hold_here && !held_before;
  const bool goes_on = request.action != HoldAction::release && held_before;
  const bool in_band =
      in.process_variable >= request.pv_low && in.process_variable <= request.pv_high;
  sample_.holding = valid && in_band && (begins || goes_on);
  if (!sample_.holding) return {.added = held_before ? step_ : 0.0, .release = held_before};

  if (new_set_point) {
    step_ = step;
    stepped_at_ = sample_.number;
  } else if (begins || request.number >= stepped_at_) {
    step_ = 0.0;
  }
  if (begins) sample_.held = in.applied;
  if (request.action == HoldAction::hold_at) sample_.held = request.output;
  sample_.held = std::clamp(sample_.held, in.limits.low, in.limits.high);
  return {.added = sample_.held - in.output, .hold_integral = true};
}

}  // namespace loopwarden::control
