// SPDX-License-Identifier: Apache-2.0
// Lines of text over a Unix domain socket: the client side, for programs that talk to the daemon.
// local_server.hpp is the daemon's side.
#pragma once

#include <chrono>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <string_view>

namespace loopwarden::base {

// The line was sent, but no answer arrived: the command may have been executed.
class NoAnswer : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// A client connection to a socket that answers lines. No call waits longer than its timeout, even
// if the daemon is stopped, its queue or socket is full, or it sends without end. Throws
// std::runtime_error if the daemon can't be reached or does not answer in time.
class LocalClient {
 public:
  static constexpr std::chrono::milliseconds kPatience{3000};

  explicit LocalClient(const std::string& path, std::chrono::milliseconds timeout = kPatience);
  LocalClient(const LocalClient&) = delete;
  LocalClient& operator=(const LocalClient&) = delete;
  ~LocalClient();

  // Sends a line and returns the line that answers it. The timeout covers both. Throws NoAnswer if
  // the answer does not arrive. A late answer to an earlier line is skipped.
  std::string request(std::string_view line, std::chrono::milliseconds timeout);

 private:
  using Moment = std::chrono::steady_clock::time_point;
  void wait(short events, Moment until) const;
  void send(std::string_view bytes, Moment until) const;
  std::string next_line(Moment until);

  int fd_;
  std::string received_;
  std::size_t looked_at_ = 0;  // bytes of received_ without a line's end
  std::size_t owed_ = 0;       // answers that have not arrived
};

}  // namespace loopwarden::base
