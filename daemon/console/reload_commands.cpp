// SPDX-License-Identifier: Apache-2.0
#include "daemon/console/reload_commands.hpp"

#include <optional>
#include <utility>

#include "daemon/console/request.hpp"

namespace loopwarden::daemon::console {

protocol::ReloadNumber ReloadCommands::reload(const protocol::ReloadRequest& request,
                                              const Sender& sender) {
  // Before a test, the page compares the loop's file with the configuration in force.
  if (sender.socket != SocketName::control && !request.dry_run.value_or(false)) {
    throw RequestError("a reload is on control.sock alone, except with dry_run");
  }
  return {operations_.reload(sender.peer, request.dry_run.value_or(false),
                             request.take_file.value_or(false))};
}

protocol::ReloadState ReloadCommands::reload_state(
    const protocol::ReloadStateRequest& request) const {
  std::optional<protocol::ReloadState> state = operations_.reload_state(request.reload.value_or(0));
  if (!state) throw RequestError("there is no such reload; the journal has the older ones");
  return std::move(*state);
}

}  // namespace loopwarden::daemon::console
