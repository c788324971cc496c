// SPDX-License-Identifier: Apache-2.0
// Compares the configuration in force with the present files of the daemon.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "daemon/protocol/daemon_client.hpp"

namespace loopwarden::protocol {

// Texts of the actions that put a file in force, for a daemon with the default folder and sockets.
struct Remedies {
  std::string reload = "Run `loopwarden reload`.";
  std::string restart =
      "Restart the daemon (`systemctl restart loopwardend`). Until it runs again, every loop is in "
      "its stop action.";
};

// Returns the differences between the configuration in force and the loop's file, with the action
// to take. Returns an empty text if both are equal. The daemon reads its files as in `reload
// --dry-run` and keeps its configuration. Gains that were set by a command, and that no file has,
// are no difference. `file_hash`: CRC-32 of the file that the caller used, if any. Throws
// DaemonError.
std::string not_in_force(Daemon& daemon, const std::string& tag,
                         std::optional<std::uint32_t> file_hash = {},
                         const Remedies& remedies = {});

// The loop's file as the daemon reads it.
struct LoopFile {
  std::string path;
  std::uint32_t hash = 0;   // CRC-32 of its text
  std::int64_t time_s = 0;  // of its last change, s since 1970
};
// Returns nullopt if the daemon has no such file, or does not answer in time. Throws DaemonError.
std::optional<LoopFile> file_of_loop(Daemon& daemon, const std::string& tag);

// Returns the same for loopwardend.yaml.
std::string box_not_in_force(Daemon& daemon, const Remedies& remedies = {});

}  // namespace loopwarden::protocol
