// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "daemon/console/operations.hpp"
#include "daemon/console/sender.hpp"
#include "daemon/protocol/requests.hpp"

namespace loopwarden::daemon::console {

// Requests reloads (`reload`) and reports their state (`reload_state`).
class ReloadCommands {
 public:
  explicit ReloadCommands(Operations& operations) : operations_(operations) {}

  // The reloader reads the files on another thread: the answer does not wait for the disk.
  protocol::ReloadNumber reload(const protocol::ReloadRequest& request, const Sender& sender);
  // Throws RequestError if the number is unknown.
  protocol::ReloadState reload_state(const protocol::ReloadStateRequest& request) const;

 private:
  Operations& operations_;
};

}  // namespace loopwarden::daemon::console
