// SPDX-License-Identifier: Apache-2.0
// A controller whose planned moves are stepped in the same call, for simulations. The daemon steps
// them on another thread.
#pragma once

#include <optional>

#include "model/control/loop_controller.hpp"
#include "model/control/moves_advisor.hpp"

namespace loopwarden::control {

class SimulatedController : public LoopController {
 public:
  SimulatedController(const ControllerSettings& settings, double period_s, double initial_set_point,
                      double initial_output) noexcept
      : LoopController(settings, period_s, initial_set_point, initial_output),
        advisor_(period_s, 1) {}

  // Steps one period; `in.moves` is set here.
  ControllerOutput step(ControllerInputs in) noexcept {
    in.moves = advisor_.request();
    const ControllerOutput out = LoopController::step(in);
    if (const MovesSample* sample = moves_sample()) advisor_.step(*sample);
    return out;
  }

  // State of the planned moves; empty before their first period.
  std::optional<MovesState> moves() const noexcept { return advisor_.state(); }

 private:
  MovesAdvisor advisor_;
};

}  // namespace loopwarden::control
