// SPDX-License-Identifier: Apache-2.0
// Moves outputs directly to their stop actions.
#pragma once

#include <vector>

#include "config/config_reader.hpp"
#include "daemon/loops/loop_runtime.hpp"

namespace loopwarden::daemon {

// Moves the outputs of loops that no thread runs any more, all at once. Logs each result.
void drive_to_stop(std::vector<LoopRuntime>& loops);

// Moves outputs without starting the loops: `loopwardend --safe`. An output that is unknown or
// unreachable does not delay the others. Prints each result. Returns the exit code.
int drive_to_stop_actions(const std::vector<config::StopOutput>& outputs);

}  // namespace loopwarden::daemon
