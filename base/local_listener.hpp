// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>

namespace loopwarden::base {

// Returns a text if another process listens at `path`, or if it can't be excluded because the path
// is not accessible; empty otherwise. Throws std::runtime_error.
std::string other_listener(const std::string& path);

// Returns a listening Unix domain socket that does not block. The owner, the owner's group and
// `group` may connect. `group` also gets access to the socket's folder, as far as the file system
// and the folder's owner permit it. Creates the folder if it is missing. Replaces a socket left
// over from a crash. Throws std::runtime_error, also if another process still listens there.
int local_listener(const std::string& path, std::optional<unsigned> group,
                   std::size_t most_waiting);

}  // namespace loopwarden::base
