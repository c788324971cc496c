// SPDX-License-Identifier: Apache-2.0
#include "daemon/loops/loop_runtime.hpp"

#include <algorithm>

namespace loopwarden::daemon {

std::optional<std::size_t> find_loop(const std::vector<LoopRuntime>& loops,
                                     const std::string& name) {
  const auto found = std::find_if(loops.begin(), loops.end(), [&](const LoopRuntime& loop) {
    return loop.config.name == name;
  });
  if (found == loops.end()) return std::nullopt;
  return static_cast<std::size_t>(found - loops.begin());
}

rt::LoopSettings settings_of(const config::LoopConfig& config, config::Backing backing) {
  return {.controller = config.controller,
          .safety = config.safety,
          .pv_check = config.pv,
          .jacket_may_act = config::interlocks_of(config.controller.jacket, backing).none(),
          .moves_may_act = config::moves_may_act(config.monitor.corrective, backing)};
}

}  // namespace loopwarden::daemon
