// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "daemon/protocol/setups.hpp"

namespace loopwarden::daemon::console {

// Returns the unfinished setups in the folder `setup` of the daemon's configuration. Other files
// and unreadable folders are skipped. Reads from the disk.
protocol::Setups setups_in(const std::filesystem::path& configuration);

}  // namespace loopwarden::daemon::console
