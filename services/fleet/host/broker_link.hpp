// SPDX-License-Identifier: Apache-2.0
// A group's connection to the broker: what edges say goes to the spool, the host's own state is kept at the broker.
//
// The state's time is that of the connection, in its birth and in its will (Sparkplug 3.0, 5.7). Whoever takes the
// group over connects by the same client identifier, so that the broker itself ends an older owner's connection, and
// with a newer time, so that the older will changes nothing.
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
  mqtt::ClientSettings client;  // subscriptions and identifier are set here
  std::string group;            // empty: all
  std::string host_id;
};

class BrokerLink {
 public:
  BrokerLink(LinkSettings settings, Spool& spool);
  BrokerLink(const BrokerLink&) = delete;
  BrokerLink& operator=(const BrokerLink&) = delete;
  // As stop().
  ~BrokerLink();

  // Whether there is to be a connection. An end of it without a goodbye: another host has the group.
  void own(bool owned) noexcept {
    goodbye_ = false;
    owned_ = owned;
  }
  // Says goodbye: another host is to have the group.
  void leave() noexcept {
    goodbye_ = true;
    owned_ = false;
  }
  // Whether edges may send: else the host says that it is offline, and they store.
  void accept(bool accepting) noexcept { accepting_ = accepting; }
  // Says goodbye and ends.
  void stop();

  // False if there is no connection, or too many wait already. What waits when the connection ends is gone.
  bool send(mqtt::Message message);

  bool connected() const noexcept { return connected_; }
  bool gone() const noexcept { return gone_; }  // no message will come
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

  // Of the thread.
  base::LimitedLog log_;
  std::unique_ptr<mqtt::Client> client_;
  std::uint64_t state_time_ms_ = 0;
  std::optional<bool> said_online_;

  std::mutex mutex_;
  std::deque<mqtt::Message> waiting_;
  base::Thread thread_;
};

}  // namespace loopwarden::fleet
