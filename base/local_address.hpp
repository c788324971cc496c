// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/un.h>

#include <cstddef>
#include <stdexcept>
#include <string>

namespace loopwarden::base {

inline constexpr std::size_t kLongestSocketPath = sizeof(sockaddr_un::sun_path) - 1;

// Returns the socket address of `path`. Throws std::runtime_error if `path` is too long.
sockaddr_un local_address(const std::string& path);

// Returns an error with the text of `what` and of errno.
std::runtime_error socket_failure(const std::string& what);

// Returns a connection that never blocks, or -1 and errno: EAGAIN if the listener's queue is full.
// Throws as local_address(), and if no descriptor is free.
int try_local_connection(const std::string& path);

}  // namespace loopwarden::base
