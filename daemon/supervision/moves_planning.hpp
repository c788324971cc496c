// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "daemon/rt/loop_channels.hpp"
#include "model/control/moves_advisor.hpp"

namespace loopwarden::daemon::supervision {

// Steps the planned moves of one loop and publishes their newest request and state. Used by the
// monitor's thread only.
class MovesPlanning {
 public:
  // `lease`: cycles for which a request is valid. `channels` outlive this.
  MovesPlanning(rt::LoopChannels& channels, double period_s, std::uint32_t lease) noexcept
      : channels_(channels), advisor_(period_s, lease) {}

  // Takes all samples of the loop.
  void take_turn() noexcept;

 private:
  rt::LoopChannels& channels_;
  control::MovesAdvisor advisor_;
};

}  // namespace loopwarden::daemon::supervision
