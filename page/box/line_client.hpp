// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <stdexcept>
#include <string>
#include <string_view>

namespace loopwarden::page {

// Nobody answers at the socket, or not in time.
class DaemonDown : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// One connection to a socket of lines. Unlike hal/os's, no call waits longer than it is told to, not even to connect
// to a daemon that is stopped and whose queue is full.
class LineClient {
 public:
  // Throws DaemonDown.
  explicit LineClient(const std::string& path);
  LineClient(const LineClient&) = delete;
  LineClient& operator=(const LineClient&) = delete;
  ~LineClient();

  // Sends a line and waits for the line that answers it. Throws DaemonDown; then this is of no more use.
  std::string request(std::string_view line, std::chrono::milliseconds patience);

 private:
  using Moment = std::chrono::steady_clock::time_point;
  void wait(short events, Moment until) const;
  void send(std::string_view bytes, Moment until) const;

  std::string path_;
  int fd_;
};

}  // namespace loopwarden::page
