// SPDX-License-Identifier: Apache-2.0
// Which socket offers which request: the one table of it.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "config/loop_config.hpp"

namespace loopwarden::daemon::console {

enum class SocketName : std::uint8_t { control, status, page, edge };

// "page", as in the journal and before ".sock".
const char* to_text(SocketName socket) noexcept;

// What the configuration lets the peers of the limited sockets order.
struct Rights {
  config::SocketRights page;
  config::SocketRights edge;

  // Of the other two sockets: all that they offer.
  config::SocketRights of(SocketName socket) const noexcept;
  friend bool operator==(const Rights&, const Rights&) = default;
};

// Whether it is for OperatorOrders, not for Readings; of requests that are offered.
bool is_order(std::string_view request) noexcept;

// Throws RequestError, with what would allow it, for a request that the socket does not offer.
void check_offered(std::string_view request, SocketName socket, const Rights& rights);

}  // namespace loopwarden::daemon::console
