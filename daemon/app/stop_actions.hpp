// SPDX-License-Identifier: Apache-2.0
// Outputs to their stop actions, straight to the devices.
#pragma once

#include <vector>

#include "config/config_reader.hpp"
#include "daemon/loops/loop_runtime.hpp"

namespace loopwarden::daemon {

// Of loops that no thread runs any more, all at once; logs what became of each.
void drive_to_stop(std::vector<LoopRuntime>& loops);

// Without starting the loops: `loopwardend --safe`. An output that is not known or not reached
// holds up no other one. Prints what became of each; returns the exit code.
int drive_to_stop_actions(const std::vector<config::StopOutput>& outputs);

}  // namespace loopwarden::daemon
