// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "daemon/protocol/answers.hpp"

namespace loopwarden::daemon::console {

// Work of the daemon that operators start and follow. Any thread. No function waits for the disk.
class Operations {
 public:
  Operations() = default;
  Operations(const Operations&) = delete;
  Operations& operator=(const Operations&) = delete;
  virtual ~Operations() = default;

  // Requests a reload. Returns its number. Throws std::runtime_error if no reload can be queued.
  virtual std::uint64_t reload(const std::string& peer, bool dry_run, bool take_file) = 0;
  // Returns the state of a reload, if there is one with this number.
  virtual std::optional<protocol::ReloadState> reload_state(std::uint64_t number) const = 0;
  // True if the newest mode, set point and output of the loop are stored for the next start.
  virtual bool command_kept(std::size_t loop) const = 0;
};

}  // namespace loopwarden::daemon::console
