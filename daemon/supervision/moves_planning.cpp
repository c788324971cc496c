// SPDX-License-Identifier: Apache-2.0
#include "daemon/supervision/moves_planning.hpp"

namespace loopwarden::daemon::supervision {

void MovesPlanning::take_turn() noexcept {
  control::MovesSample sample;
  bool stepped = false;
  for (; channels_.moves_samples.try_pop(sample); stepped = true) advisor_.step(sample);
  if (stepped) {
    channels_.moves_requests.publish(advisor_.request());
    channels_.moves.publish(advisor_.state().value_or(control::MovesState{}));
  }
  // No sample means: not automatic, or another compensator.
  if (!channels_.moves_run.load(std::memory_order_acquire)) channels_.moves.clear();
}

}  // namespace loopwarden::daemon::supervision
