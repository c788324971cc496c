// SPDX-License-Identifier: Apache-2.0
#include "hal/os/local_socket.hpp"

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <stdexcept>

#include "hal/os/local_address.hpp"

namespace loopwarden::hal::os {

LocalClient::LocalClient(const std::string& path) : fd_(try_local_connection(path)) {
  if (fd_ < 0) throw socket_failure("no daemon answers at " + path);
}

LocalClient::~LocalClient() { close(fd_); }

std::string LocalClient::request(std::string_view line, std::chrono::milliseconds timeout) {
  std::string message(line);
  message += '\n';
  for (std::size_t sent = 0; sent < message.size();) {
    const ssize_t n = send(fd_, message.data() + sent, message.size() - sent, MSG_NOSIGNAL);
    if (n < 0) throw socket_failure("the daemon closed the connection");
    sent += static_cast<std::size_t>(n);
  }
  const auto deadline = std::chrono::steady_clock::now() + timeout;
  for (;;) {
    const std::size_t end = received_.find('\n');
    if (end != std::string::npos) {
      std::string answer = received_.substr(0, end);
      received_.erase(0, end + 1);
      return answer;
    }
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(
        deadline - std::chrono::steady_clock::now());
    pollfd waiting{fd_, POLLIN, 0};
    const int ready = poll(&waiting, 1, static_cast<int>(std::max<std::int64_t>(left.count(), 0)));
    if (ready < 0 && errno == EINTR) continue;
    if (ready <= 0) throw NoAnswer("the daemon did not answer in time");
    std::array<char, 4096> buffer{};
    const ssize_t n = recv(fd_, buffer.data(), buffer.size(), 0);
    if (n <= 0) throw NoAnswer("the daemon closed the connection");
    received_.append(buffer.data(), static_cast<std::size_t>(n));
  }
}

}  // namespace loopwarden::hal::os
