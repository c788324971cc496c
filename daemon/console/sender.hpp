// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "daemon/console/access.hpp"
#include "protocol/requests.hpp"

namespace loopwarden::daemon::console {

// Who orders.
struct Sender {
  SocketName socket = SocketName::control;
  std::string peer;  // for journal and log
};

// "uid 1000" on control.sock. On the limited sockets the peer speaks for others and may name one, by "user" and "address":
// "anna@10.0.0.5 by page (uid 997)". Throws RequestError for names elsewhere, for more than 64 characters, and for others
// than printable ASCII without blank, quotes, backslash and @: a name must not look like another part of the text.
Sender sender_of(const protocol::Person& person, SocketName socket, unsigned uid);

}  // namespace loopwarden::daemon::console
