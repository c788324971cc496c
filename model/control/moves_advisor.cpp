// SPDX-License-Identifier: Apache-2.0
#include "model/control/moves_advisor.hpp"

namespace loopwarden::control {

bool MovesAdvisor::goes_on(const MovesSample& sample) const noexcept {
  return moves_ && sample.run == before_.run && sample.number == before_.number + 1 &&
         sample.settings == before_.settings && (before_.shadow || !sample.shadow);
}

const MovesRequest& MovesAdvisor::step(const MovesSample& sample) noexcept {
  if (!goes_on(sample)) {
    PlannedMoves next(sample.settings, sample.shadow, period_s_);
    if (moves_) next.continue_hour(*moves_);
    moves_ = next;
  } else if (before_.shadow && !sample.shadow) {
    moves_->act();
  }
  before_ = sample;
  request_ = moves_->step(sample);
  request_.run = sample.run;
  request_.shadow = sample.shadow;
  request_.number = sample.number;
  request_.valid_until = sample.number + lease_;
  return request_;
}

std::optional<MovesState> MovesAdvisor::state() const noexcept {
  if (!moves_) return std::nullopt;
  return moves_->state();
}

}  // namespace loopwarden::control
