// SPDX-License-Identifier: Apache-2.0
// Lines of text over a Unix domain socket: how the programs beside the daemon talk to it. The daemon's side is
// local_server.hpp.
#pragma once

#include <chrono>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <string_view>

namespace loopwarden::base {

// The line went out, and no answer came: whatever it asks for may have been done.
class NoAnswer : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// One connection to a socket of lines. No call waits longer than it is told to, neither for a daemon that is stopped, whose queue of
// connections or whose socket is full, nor for one that sends without end. Throws std::runtime_error when the daemon can't be reached
// or does not answer in time.
class LocalClient {
 public:
  static constexpr std::chrono::milliseconds kPatience{3000};

  explicit LocalClient(const std::string& path, std::chrono::milliseconds timeout = kPatience);
  LocalClient(const LocalClient&) = delete;
  LocalClient& operator=(const LocalClient&) = delete;
  ~LocalClient();

  // Sends a line and waits for the line that answers it; the timeout is of both together. NoAnswer where none comes. The
  // late answer to an earlier line is left out.
  std::string request(std::string_view line, std::chrono::milliseconds timeout);

 private:
  using Moment = std::chrono::steady_clock::time_point;
  void wait(short events, Moment until) const;
  void send(std::string_view bytes, Moment until) const;
  std::string next_line(Moment until);

  int fd_;
  std::string received_;
  std::size_t looked_at_ = 0;  // bytes of received_ without a line's end
  std::size_t owed_ = 0;       // answers that have not come
};

}  // namespace loopwarden::base
