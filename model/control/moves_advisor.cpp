// SPDX-License-Identifier: Apache-2.0
#include "model/control/moves_advisor.hpp"

namespace loopwarden::control {

const MovesRequest& MovesAdvisor::step(const MovesSample& sample) noexcept {
  if (!moves_ || sample.run != request_.run || sample.number != request_.number + 1) {
    PlannedMoves next(sample.settings, sample.shadow, period_s_);
    if (moves_) next.continue_hour(*moves_);
    moves_ = next;
  } else if (!sample.shadow) {
    moves_->act();
  }
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
