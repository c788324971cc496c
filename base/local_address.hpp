// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/un.h>

#include <cstddef>
#include <stdexcept>
#include <string>

namespace loopwarden::base {

inline constexpr std::size_t kLongestSocketPath = sizeof(sockaddr_un::sun_path) - 1;

// Throws std::runtime_error for a path that is too long for one.
sockaddr_un local_address(const std::string& path);

// `what`, and errno in words.
std::runtime_error socket_failure(const std::string& what);

// A connection that never blocks, or -1 and errno: EAGAIN if the queue of who listens is full. Throws as local_address(), and if
// there is no descriptor.
int try_local_connection(const std::string& path);

}  // namespace loopwarden::base
