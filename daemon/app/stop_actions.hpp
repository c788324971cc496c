// SPDX-License-Identifier: Apache-2.0
// Outputs to their stop actions, straight to the devices.
#pragma once

#include <vector>

#include "config/loop_config.hpp"
#include "daemon/loops/loop_runtime.hpp"

namespace loopwarden::daemon {

// Of loops that no thread runs any more, all at once; logs what became of each.
void drive_to_stop(std::vector<LoopRuntime>& loops);

// Of all loops, without starting them: `loopwardend --safe`. Prints what became of each; returns the exit code.
int drive_to_stop_actions(const config::Configuration& configuration);

}  // namespace loopwarden::daemon
