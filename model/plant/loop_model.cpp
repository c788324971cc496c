// SPDX-License-Identifier: Apache-2.0
#include "model/plant/loop_model.hpp"

namespace loopwarden::plant {

const char* to_text(Block block) noexcept {
  switch (block) {
    case Block::controller: return "controller";
    case Block::valve: return "valve";
    case Block::process: return "process";
    case Block::transmitter: return "transmitter";
    case Block::disturbance: break;
  }
  return "disturbance";
}

}  // namespace loopwarden::plant
