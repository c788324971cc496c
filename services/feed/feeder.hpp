// SPDX-License-Identifier: Apache-2.0
// Passes values from a broker to feed.sock, in one thread. The broker's connection has its own
// thread and never blocks this one.
//
// While the broker is away, the feeder sends no values and no sign of life, so the daemon finds the
// values stale. When the broker is back, all earlier values are bad until they arrive again,
// because messages may have been missed meanwhile. A new connection to feed.sock starts with the
// newest of every value.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "base/limited_log.hpp"
#include "services/net/mqtt/client.hpp"
#include "services/feed/feed_config.hpp"
#include "services/feed/feed_link.hpp"
#include "services/feed/values/foreign_edges.hpp"
#include "services/feed/values/topics.hpp"

namespace loopwarden::feed {

class Feeder {
 public:
  explicit Feeder(FeedConfig config);

  void start() { client_.connect(std::nullopt); }
  // Waits a moment for messages of the broker and handles them.
  void round();
  void end() { client_.leave(); }

  std::string status() const;  // one line

 private:
  using Clock = std::chrono::steady_clock;

  void take(const mqtt::Event& event);
  void take_message(const mqtt::Message& message);
  void broker_came();
  void broker_went(const std::string& why);
  void keep_link();
  void ask_rebirths();
  void deliver();
  void send(const std::vector<protocol::FedValue>& values);
  void send_newest();
  void send_lost();
  std::string broker_name() const;
  void complain(const std::string& what);

  FeedConfig config_;
  Topics topics_;
  ForeignEdges edges_;
  FeedLink link_;
  std::map<std::string, protocol::FedValue> newest_;
  std::vector<protocol::FedValue> values_;  // of this round, not yet sent
  bool broker_there_ = false;
  std::string link_trouble_;
  Clock::time_point last_line_{};
  base::LimitedLog log_;
  Clock::time_point complain_again_{};
  std::uint64_t complaints_ = 0;  // since the last that was logged
  mqtt::Client client_;           // last: its thread ends first
};

}  // namespace loopwarden::feed
