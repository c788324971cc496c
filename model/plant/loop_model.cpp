// SPDX-License-Identifier: Apache-2.0
#include "model/plant/loop_model.hpp"

#include <cmath>

#include "model/numeric/enum_name.hpp"

namespace loopwarden::plant {

const char* to_text(Block block) noexcept {
  return numeric::enum_name<Block::disturbance>(
      block, {"controller", "valve", "process", "transmitter", "disturbance"});
}

double answer_s(const LoopModel& model) noexcept {
  const ProcessParameters& p = model.process;
  const double kp = model.controller.pid.gains.kp;
  const bool led = p.integrating() && kp > 0.0;
  return p.lags_and_dead_time_s() + (led ? 1.0 / (std::abs(p.gain) * kp) : 0.0);
}

}  // namespace loopwarden::plant
