// SPDX-License-Identifier: Apache-2.0
#include "base/local_address.hpp"

#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace loopwarden::base {

sockaddr_un local_address(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() > kLongestSocketPath) {
    throw std::runtime_error("socket path is longer than " + std::to_string(kLongestSocketPath) +
                             " characters: " + path);
  }
  std::copy(path.begin(), path.end(), address.sun_path);
  return address;
}

std::runtime_error socket_failure(const std::string& what) {
  return std::runtime_error(what + ": " + std::strerror(errno));
}

int try_local_connection(const std::string& path) {
  const sockaddr_un address = local_address(path);
  const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd < 0) throw socket_failure("socket");
  if (connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) return fd;
  const int error = errno;
  close(fd);
  errno = error;
  return -1;
}

}  // namespace loopwarden::base
