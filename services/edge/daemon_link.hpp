// SPDX-License-Identifier: Apache-2.0
// One of the daemon's sockets: connects when asked and again when the daemon is back.
#pragma once

#include <chrono>
#include <optional>
#include <stdexcept>
#include <string>

#include <nlohmann/json.hpp>

#include "base/local_socket.hpp"

namespace loopwarden::edge {

class DaemonAway : public std::runtime_error {
 public:
  DaemonAway(const std::string& what, bool may_be_done)
      : std::runtime_error(what), may_be_done_(may_be_done) {}
  // The request reached it and no answer came: what it asks for may have been done.
  bool may_be_done() const noexcept { return may_be_done_; }

 private:
  bool may_be_done_;
};
// It answers, and does not do it; what() are its own words.
class DaemonRefused : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class DaemonLink {
 public:
  DaemonLink(std::string socket_path, std::chrono::milliseconds patience)
      : path_(std::move(socket_path)), patience_(patience) {}

  // Throws DaemonAway or DaemonRefused.
  nlohmann::json ask(const nlohmann::json& request);

 private:
  std::string answer_to(const std::string& line);

  std::string path_;
  std::chrono::milliseconds patience_;
  std::optional<base::LocalClient> client_;
};

}  // namespace loopwarden::edge
