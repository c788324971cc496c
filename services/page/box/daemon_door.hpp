// SPDX-License-Identifier: Apache-2.0
// One of the daemon's sockets, asked by several threads.
#pragma once

#include <chrono>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "base/local_socket.hpp"

namespace loopwarden::page {

// Nobody answers at the socket, or not in time.
class DaemonDown : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// The daemon answers that it won't; its words.
class DaemonRefused : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// What the API asks of the daemon.
class Daemon {
 public:
  virtual ~Daemon() = default;
  // Throws DaemonDown or DaemonRefused.
  virtual nlohmann::json ask(const nlohmann::json& request) = 0;
};

// Any thread.
class DaemonDoor final : public Daemon {
 public:
  // `reused`: kept for the next request. Not for orders: where a connection fails nobody can tell
  // whether the order came through, and it must not be sent twice.
  enum class Connections { reused, fresh };
  DaemonDoor(std::string socket, std::chrono::milliseconds patience,
             Connections connections = Connections::reused)
      : socket_(std::move(socket)), patience_(patience), connections_(connections) {}

  nlohmann::json ask(const nlohmann::json& request) override;
  // The answer as it was sent. Throws DaemonDown.
  std::string ask_text(const std::string& request);

 private:
  std::unique_ptr<base::LocalClient> take();
  void give_back(std::unique_ptr<base::LocalClient> client);

  std::string socket_;
  std::chrono::milliseconds patience_;
  Connections connections_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<base::LocalClient>> idle_;
};

}  // namespace loopwarden::page
