// SPDX-License-Identifier: Apache-2.0
// Checks whether a socket may serve a request.
#pragma once

#include <cstdint>
#include <string_view>

#include "config/loop_config.hpp"

namespace loopwarden::daemon::console {

enum class SocketName : std::uint8_t { control, status, page, edge };

// Returns the name in the journal and in front of ".sock".
const char* to_text(SocketName socket) noexcept;

// Rights that the configuration gives to the peers of page.sock and edge.sock.
struct Rights {
  config::SocketRights page;
  config::SocketRights edge;

  // Returns all rights for the other two sockets.
  config::SocketRights of(SocketName socket) const noexcept;
  friend bool operator==(const Rights&, const Rights&) = default;
};

// Right that page.sock and edge.sock need for a request; any: at least one of them.
enum class Need : std::uint8_t { nothing, any, alarms, control, tuning, reports, tests };

// Sockets that offer a request; control.sock offers all of them.
struct Access {
  bool on_status = false;   // status.sock, for requests that only read
  bool on_limited = false;  // page.sock and edge.sock
  Need need = Need::nothing;
};

// Throws RequestError, with the sockets that offer the request or the key that would allow it, if
// the socket must not serve the request.
void check_access(std::string_view request, const Access& access, SocketName socket,
                  const Rights& rights);

}  // namespace loopwarden::daemon::console
