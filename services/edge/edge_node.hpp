// SPDX-License-Identifier: Apache-2.0
// Runs the box as a Sparkplug edge node: reads the daemon once per interval, sends changes to the
// broker, and takes commands. One thread. The broker's connection has its own thread and never
// blocks this one.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "services/edge/command.hpp"
#include "services/edge/daemon_view.hpp"
#include "services/edge/device.hpp"
#include "services/edge/edge_config.hpp"
#include "services/edge/file_parts.hpp"
#include "services/edge/orders.hpp"
#include "services/edge/outbox.hpp"
#include "services/edge/store.hpp"
#include "base/limited_log.hpp"
#include "services/net/mqtt/client.hpp"
#include "services/net/sparkplug/edge_session.hpp"
#include "services/net/sparkplug/rebirth_policy.hpp"
#include "services/net/sparkplug/topic.hpp"

namespace loopwarden::edge {

class EdgeNode {
 public:
  // Throws sqlite::Error if the store can't be opened or made.
  explicit EdgeNode(EdgeConfig config);

  void start();
  // Handles events of the broker until the next reading of the daemon is due.
  void round();
  // Sends its own NDEATH and disconnects. Reports that may not have arrived go to the store.
  void end();

  std::string status() const;  // one line

 private:
  using Clock = std::chrono::steady_clock;

  // --- the daemon ---
  void look();
  void daemon_came(bool changed);
  void daemon_went(const std::string& why);
  void keep_births();
  void make_devices();
  void tell_changes();

  // --- the broker ---
  void connect();
  void take(const mqtt::Event& event);
  void take_message(const mqtt::Message& message);
  void follow(sparkplug::EdgeSession::Next next);
  void answer_rebirth();
  void births();
  void device_births();
  void device_deaths();
  void leave();

  // --- commands ---
  void node_command(const sparkplug::Payload& payload);
  void device_command(const std::string& device, const sparkplug::Payload& payload);
  void acknowledge_all();
  void want_evidence(std::size_t loop, const std::string& wanted);
  void tell_outcomes();

  // --- out ---
  bool publish(sparkplug::MessageType type, const std::string& device,
               std::vector<sparkplug::Metric> metrics);
  bool send(const Report& report, bool historical);
  void report(Report report);
  void send_files();
  mqtt::Message death() const;
  Reading node_reading() const;
  Device* find(const std::string& device);
  std::uint64_t now_ms();

  EdgeConfig config_;
  Store store_;
  Outbox outbox_;
  sparkplug::EdgeSession session_;
  DaemonView view_;
  Orders orders_;
  FileParts files_;
  Device node_;
  std::vector<Device> devices_;  // one per loop, in the daemon's order
  std::map<std::string, std::size_t> by_name_;
  bool daemon_there_ = false;
  bool rebirth_waits_ = false;                   // requested, not yet answered
  sparkplug::RebirthBudget rebirths_{0.2, 2.0};  // two at once, then one in 5 s
  base::LimitedLog log_;
  bool starting_ = false;
  std::string daemon_trouble_;
  std::uint64_t last_ms_ = 0;
  Clock::time_point next_look_;
  mqtt::Client client_;  // last: its thread ends first
};

}  // namespace loopwarden::edge
