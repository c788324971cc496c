// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "daemon/console/access.hpp"

#include "daemon/protocol/requests.hpp"

namespace loopwarden::daemon::console {

// Sender of a command.
struct Sender {
  SocketName socket = SocketName::control;
  std::string peer;  // for journal and log
};

// Returns the sender: "uid 1000" on control.sock. The peers of page.sock and edge.sock act for
// their users and may name one by "user" and "address": "anna@10.0.0.5 by page (uid 997)".
//
// A name has at most 64 characters of printable ASCII without blank, quotes, backslash and @, so
// that it can't imitate another part of the text. Throws RequestError for other names, and for
// names on the other sockets.
Sender sender_of(const protocol::Person& person, SocketName socket, unsigned uid);

}  // namespace loopwarden::daemon::console
