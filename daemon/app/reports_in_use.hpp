// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "daemon/loops/loop_runtime.hpp"

namespace loopwarden::daemon {

// Whether twin or specialists of a loop lie in the folder: of one that runs, or of one in the files, whose next start needs
// them. Where the files can't be read, they may.
bool needed_by_loops(const std::filesystem::path& folder, const std::vector<LoopRuntime>& loops,
                     const std::filesystem::path& configuration);

}  // namespace loopwarden::daemon
