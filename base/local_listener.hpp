// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>

namespace loopwarden::base {

// A listening Unix domain socket that does not block. May connect besides the owner and his group: `group`, which may
// also reach the socket through its folder; where neither the file system nor the folder's owner stands against it.
// Replaces a socket left over from a crash; refuses if another process still listens there. Throws std::runtime_error.
int local_listener(const std::string& path, std::optional<unsigned> group,
                   std::size_t most_waiting);

}  // namespace loopwarden::base
