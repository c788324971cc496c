// SPDX-License-Identifier: Apache-2.0
// Lines of text over a Unix domain socket: how the workbench talks to the daemon on the same box. The daemon's side is
// local_server.hpp.
#pragma once

#include <chrono>
#include <stdexcept>
#include <string>
#include <string_view>

namespace loopwarden::hal::os {

// The line went out, and no answer came: whatever it asks for may have been done.
class NoAnswer : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// One connection from the workbench. Throws std::runtime_error when the daemon can't be reached or
// does not answer.
class LocalClient {
 public:
  explicit LocalClient(const std::string& path);
  LocalClient(const LocalClient&) = delete;
  LocalClient& operator=(const LocalClient&) = delete;
  ~LocalClient();

  // Sends a line and waits for the line that answers it; NoAnswer where none comes.
  std::string request(std::string_view line, std::chrono::milliseconds timeout);

 private:
  int fd_;
  std::string received_;
};

}  // namespace loopwarden::hal::os
