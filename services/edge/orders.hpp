// SPDX-License-Identifier: Apache-2.0
// Passes hosts' commands to the daemon through edge.sock and reports the outcome of each. The
// daemon checks them like those of any operator, and offers only what its own configuration allows.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "services/edge/command.hpp"
#include "daemon/protocol/daemon_client.hpp"

namespace loopwarden::edge {

class Orders {
 public:
  struct Outcome {
    std::string device;
    std::string text;  // "sp 5: done", "sp 5: refused: ..."
  };

  // `allowed`: `orders` of edge.yaml. If false, every command is refused here.
  Orders(const std::filesystem::path& runtime_directory, bool allowed);

  // Passes the command to the daemon. outcomes() returns its outcome.
  void give(const std::string& device, const std::string& tag, const Order& order);
  struct Loop {
    std::string device;
    std::string tag;
    bool waits;  // has an alarm to acknowledge, as far as is known here
  };
  // Uses one request for all alarms, so that the daemon waits for its disk only once.
  void acknowledge_all(const std::vector<Loop>& loops);
  void refuse(const std::string& device, const std::string& why) { done_.push_back({device, why}); }
  // Returns the commands that have ended since the last call.
  std::vector<Outcome> outcomes();

 private:
  struct Waiting {
    std::string device;
    std::string tag;
    std::string what;
    std::uint64_t number;  // the daemon's number of the command
    std::chrono::steady_clock::time_point since;
  };
  // Returns true if it has ended.
  bool ask_after(const Waiting& order);

  protocol::DaemonClient daemon_;
  bool allowed_;
  std::vector<Waiting> waiting_;
  std::vector<Outcome> done_;
};

}  // namespace loopwarden::edge
