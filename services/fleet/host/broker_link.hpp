// SPDX-License-Identifier: Apache-2.0
// A group's connection to the broker. Messages from edges go to the spool. The host's own state is
// retained at the broker.
//
// The state's birth and will both have the time of the connection (Sparkplug 3.0, 5.7). A new owner
// of the group connects with the same client identifier, so the broker itself ends the older
// owner's connection. It also has a newer time, so the older will has no effect.
#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "services/fleet/host/spool.hpp"
#include "services/net/mqtt/client.hpp"
#include "base/limited_log.hpp"
#include "base/thread.hpp"

namespace loopwarden::fleet {

struct LinkSettings {
  mqtt::ClientSettings client;  // subscriptions and client identifier are set here
  std::string group;            // empty: all groups
  std::string host_id;
};

class BrokerLink {
 public:
  BrokerLink(LinkSettings settings, Spool& spool);
  BrokerLink(const BrokerLink&) = delete;
  BrokerLink& operator=(const BrokerLink&) = delete;
  // Calls stop().
  ~BrokerLink();

  // Sets whether this host serves the group. false: another host has the group; the connection ends
  // without publishing a state.
  void own(bool owned) noexcept {
    goodbye_ = false;
    owned_ = owned;
  }
  // Publishes the offline state and disconnects, so that another host can take the group.
  void leave() noexcept {
    goodbye_ = true;
    owned_ = false;
  }
  // Sets whether edges may send. Otherwise the host publishes that it is offline, and edges store
  // their values.
  void accept(bool accepting) noexcept { accepting_ = accepting; }
  // Publishes the offline state, disconnects and ends the thread.
  void stop();

  // Queues a message. Returns false without a connection, or if too many messages are waiting.
  // Waiting messages are lost when the connection ends.
  bool send(mqtt::Message message);

  bool connected() const noexcept { return connected_; }
  bool gone() const noexcept { return gone_; }  // no more messages will arrive
  std::uint64_t connections() const noexcept { return connections_; }

 private:
  void run();
  void serve();
  void open();
  void try_connection();
  void handle(mqtt::Event event);
  void hear_own_state(const mqtt::Message& message);
  void say_state(bool online);
  void send_waiting();
  void forget_waiting();
  void end(bool goodbye);
  void await_end();

  const LinkSettings settings_;
  Spool& spool_;
  std::atomic<bool> owned_{false};
  std::atomic<bool> accepting_{true};
  std::atomic<bool> goodbye_{false};
  std::atomic<bool> quit_{false};
  std::atomic<bool> connected_{false};
  std::atomic<bool> gone_{true};
  std::atomic<std::uint64_t> connections_{0};

  // For the thread only.
  base::LimitedLog log_;
  std::unique_ptr<mqtt::Client> client_;
  std::uint64_t state_time_ms_ = 0;
  std::optional<bool> said_online_;

  std::mutex mutex_;
  std::deque<mqtt::Message> waiting_;
  base::Thread thread_;
};

}  // namespace loopwarden::fleet
