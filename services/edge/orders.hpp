// SPDX-License-Identifier: Apache-2.0
// Hands hosts' orders to the daemon through edge.sock and tells what became of each. The daemon judges them as it judges
// any operator's, and offers only what its own configuration allows.
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

  // `allowed`: edge.yaml's orders; false: every order is refused here.
  Orders(const std::filesystem::path& runtime_directory, bool allowed);

  // Gives the order to the daemon; its outcome, or what it waits for, comes by outcomes().
  void give(const std::string& device, const std::string& tag, const Order& order);
  struct Loop {
    std::string device;
    std::string tag;
    bool waits;  // has an alarm to acknowledge, as far as is known here
  };
  // In one request, however many alarms wait: the daemon's disk is waited for once.
  void acknowledge_all(const std::vector<Loop>& loops);
  void refuse(const std::string& device, const std::string& why) { done_.push_back({device, why}); }
  // Those that came to an end since the last call.
  std::vector<Outcome> outcomes();

 private:
  struct Waiting {
    std::string device;
    std::string tag;
    std::string what;
    std::uint64_t number;  // the daemon's
    std::chrono::steady_clock::time_point since;
  };
  // True if it has ended.
  bool ask_after(const Waiting& order);

  protocol::DaemonClient daemon_;
  bool allowed_;
  std::vector<Waiting> waiting_;
  std::vector<Outcome> done_;
};

}  // namespace loopwarden::edge
