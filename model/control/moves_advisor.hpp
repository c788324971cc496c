// SPDX-License-Identifier: Apache-2.0
// Steps planned moves over the samples of a loop and answers with requests to MoveHold.
//
// Planned moves start again if samples were lost or the law was restarted, as by new settings.
// The moves of the last hour count over each start. A shadow that begins to act keeps its
// estimates. No call allocates or throws.
#pragma once

#include <cstdint>
#include <optional>

#include "model/control/move_hold.hpp"
#include "model/control/planned_moves.hpp"

namespace loopwarden::control {

class MovesAdvisor {
 public:
  // A request is valid for `lease` periods after its sample.
  MovesAdvisor(double period_s, std::uint32_t lease) noexcept
      : period_s_(period_s), lease_(lease) {}

  // Returns the request to the periods after `sample`.
  const MovesRequest& step(const MovesSample& sample) noexcept;

  const MovesRequest& request() const noexcept { return request_; }
  // Empty before the first sample.
  std::optional<MovesState> state() const noexcept;

 private:
  double period_s_;
  std::uint32_t lease_;
  std::optional<PlannedMoves> moves_;
  MovesRequest request_;  // to the newest sample
};

}  // namespace loopwarden::control
