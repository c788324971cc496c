// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "daemon/loops/loop_runtime.hpp"

namespace loopwarden::daemon {

// Returns whether the folder contains the twin or specialists of a running loop, or of a loop in
// the files. Loops in the files need them at the next start. If the files can't be read, it returns
// true.
bool needed_by_loops(const std::filesystem::path& folder, const std::vector<LoopRuntime>& loops,
                     const std::filesystem::path& configuration);

}  // namespace loopwarden::daemon
