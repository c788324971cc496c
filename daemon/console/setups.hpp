// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "daemon/protocol/setups.hpp"

namespace loopwarden::daemon::console {

// What `loopwarden setup` has kept in the folder `setup` of the daemon's configuration. A file that is none of a setup, or a
// folder that can't be read, tells nothing. Reads from the disk.
protocol::Setups setups_in(const std::filesystem::path& configuration);

}  // namespace loopwarden::daemon::console
