// SPDX-License-Identifier: Apache-2.0
#include "daemon/loops/loop_runtime.hpp"

namespace loopwarden::daemon {

rt::LoopSettings settings_of(const config::LoopConfig& config, config::Backing backing) {
  return {.controller = config.controller,
          .safety = config.safety,
          .pv_check = config.pv,
          .jacket_may_act = config::interlocks_of(config.controller.jacket, backing).none()};
}

}  // namespace loopwarden::daemon
