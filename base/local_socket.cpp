// SPDX-License-Identifier: Apache-2.0
#include "base/local_socket.hpp"

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <stdexcept>
#include <thread>

#include "base/local_address.hpp"

namespace loopwarden::base {
namespace {

using SteadyClock = std::chrono::steady_clock;

constexpr std::size_t kMostAnswerBytes = 256UL * 1024UL * 1024UL;
constexpr std::size_t kPieceBytes = 64UL * 1024UL;

// poll() can't wait for room in a full queue of connections.
int connected(const std::string& path, SteadyClock::time_point until) {
  constexpr std::chrono::milliseconds kBetweenTries{5};
  for (;;) {
    const int fd = try_local_connection(path);
    if (fd >= 0) return fd;
    const bool full = errno == EAGAIN || errno == EINTR;
    if (!full || SteadyClock::now() >= until) throw socket_failure("no daemon answers at " + path);
    std::this_thread::sleep_for(kBetweenTries);
  }
}

}  // namespace

LocalClient::LocalClient(const std::string& path, std::chrono::milliseconds timeout)
    : fd_(connected(path, SteadyClock::now() + timeout)) {}

LocalClient::~LocalClient() { close(fd_); }

void LocalClient::wait(short events, Moment until) const {
  for (;;) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - SteadyClock::now());
    pollfd waiting{fd_, events, 0};
    const int ready = poll(&waiting, 1, static_cast<int>(std::max<std::int64_t>(left.count(), 0)));
    if (ready > 0) return;
    if (ready == 0) throw std::runtime_error("the daemon did not answer in time");
    if (errno != EINTR) throw socket_failure("the daemon's socket");
  }
}

void LocalClient::send(std::string_view bytes, Moment until) const {
  try {
    while (!bytes.empty()) {
      const ssize_t n = ::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (n >= 0) {
        bytes.remove_prefix(static_cast<std::size_t>(n));
      } else if (errno == EAGAIN) {
        wait(POLLOUT, until);
      } else if (errno != EINTR) {
        throw socket_failure("the daemon closed the connection");
      }
    }
  } catch (const std::exception&) {
    // Half a line that was sent must not become the beginning of the next one.
    shutdown(fd_, SHUT_RDWR);
    throw;
  }
}

std::string LocalClient::next_line(Moment until) {
  std::array<char, kPieceBytes> piece;  // NOLINT: filled by recv
  for (;;) {
    const std::size_t end = received_.find('\n', looked_at_);
    if (end != std::string::npos) {
      std::string line = received_.substr(0, end);
      received_.erase(0, end + 1);
      looked_at_ = 0;
      return line;
    }
    looked_at_ = received_.size();
    if (received_.size() >= kMostAnswerBytes) {
      throw std::runtime_error("the daemon's answer does not end");
    }
    wait(POLLIN, until);
    const ssize_t n = recv(fd_, piece.data(), piece.size(), 0);
    if (n < 0 && (errno == EAGAIN || errno == EINTR)) continue;
    if (n <= 0) throw std::runtime_error("the daemon closed the connection");
    received_.append(piece.data(), static_cast<std::size_t>(n));
  }
}

std::string LocalClient::request(std::string_view line, std::chrono::milliseconds timeout) {
  const Moment until = SteadyClock::now() + timeout;
  send(std::string(line) + '\n', until);
  ++owed_;
  try {
    for (;;) {
      std::string answer = next_line(until);
      if (--owed_ == 0) return answer;
    }
  } catch (const std::exception& e) {
    throw NoAnswer(e.what());
  }
}

}  // namespace loopwarden::base
