// SPDX-License-Identifier: Apache-2.0
// Whether the daemon runs a loop as the loop's file is now.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "daemon/protocol/daemon_client.hpp"

namespace loopwarden::workbench {

// Returns what differs between the configuration in force and the loop's file, and what to do;
// empty if nothing differs. The daemon reads its files as in `reload --dry-run` and changes
// nothing. Gains that were ordered and that no file has are no difference. `file_hash`: CRC-32 of
// the file that the caller judges by, if it has one. Throws DaemonError.
std::string not_in_force(protocol::Daemon& daemon, const std::string& tag,
                         std::optional<std::uint32_t> file_hash = {});

// The same of loopwardend.yaml.
std::string box_not_in_force(protocol::Daemon& daemon);

}  // namespace loopwarden::workbench
