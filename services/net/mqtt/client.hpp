// SPDX-License-Identifier: Apache-2.0
// A connection to an MQTT 3.1.1 broker (libmosquitto) that never blocks its user. The network has
// its own thread. The user fetches events.
//
//   client.connect(will)          one attempt, after the wait that earlier failures require
//   for (Event& e : client.events(1s)) ...   connected | message ... | disconnected;
//                                 then connect() again
//
// Keep-alive detects a broker that accepts the connection and then is silent. The connection is
// closed after one to two keep-alive times, also while it is being made. Limit: for a message of
// QoS 0 that was written to the network, delivery to the broker is unknown.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "base/back_off.hpp"
#include "services/net/mqtt/broker_url.hpp"
#include "base/secret/secret.hpp"
#include "base/thread.hpp"

struct mosquitto;
struct mosquitto_message;

namespace loopwarden::mqtt {

enum class Qos : std::uint8_t { at_most_once = 0, at_least_once = 1 };

struct Subscription {
  std::string filter;
  Qos qos = Qos::at_least_once;
};

// Settings of a client. Files and secrets are read again at each connection, so a renewed
// certificate needs no restart.
struct ClientSettings {
  BrokerUrl broker;
  std::string client_id;  // unique at the broker
  std::string user;       // empty: no user
  base::Secret password;
  std::string ca_file;           // for TLS; empty: the system's CAs
  std::string certificate_file;  // the client's certificate; empty: no certificate
  base::Secret key;
  std::chrono::seconds keep_alive{15};  // at least 5, a limit of libmosquitto
  std::chrono::milliseconds reconnect_min{1000};
  std::chrono::milliseconds reconnect_max{60'000};
  std::size_t most_waiting = 200;     // limit of waiting()
  std::size_t most_events = 100'000;  // events not fetched yet; at the limit the network waits
  std::vector<Subscription>
      subscriptions;  // made at every connection; it counts as connected when all are granted
};

struct Message {
  std::string topic;
  std::string payload;
  Qos qos = Qos::at_most_once;
  bool retain = false;
};

struct Event {
  enum class Kind : std::uint8_t { connected, disconnected, message };
  Kind kind = Kind::message;
  Message message;
  std::string why;  // reason; for disconnected
};

class Client {
 public:
  // Throws std::runtime_error if no thread can be started.
  explicit Client(ClientSettings settings);
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;
  // Disconnects without notice, so the broker publishes the will. Waits for a name server that
  // hangs.
  ~Client();

  // Tries to connect once, with this will and a clean session. Call it at the start and after each
  // `disconnected`.
  void connect(std::optional<Message> will);
  // Disconnects in order (the will is not published) when no message is waiting, at the latest
  // after 2 s. A pending confirmation would make the broker treat the connection as broken.
  // `disconnected` follows, also if the broker hangs. The next attempt has the shortest wait. Has
  // no effect without a connection.
  void leave();

  // Publishes a message. Returns false, and does not send, if not connected or if too many messages
  // are waiting.
  bool publish(const Message& message);
  // Messages accepted by publish() but not yet on the network (QoS 0) or confirmed (QoS 1).
  std::size_t waiting() const noexcept { return waiting_.load(std::memory_order_relaxed); }
  bool connected() const noexcept { return connected_.load(std::memory_order_relaxed); }

  // Returns the events since the last call, in order. Waits up to `patience` for the first one.
  std::vector<Event> events(std::chrono::milliseconds patience);

 private:
  using Clock = std::chrono::steady_clock;

  void run();
  bool wait_for_attempt();
  void attempt();
  void open(const std::optional<Message>& will);
  void set_up(const std::optional<Message>& will);
  void secure();
  std::string serve();
  void say_goodbye();
  void close();
  void push(Event event);

  void on_connack(int code);
  void on_suback(int most_granted);
  void on_message(const mosquitto_message& message);

  const ClientSettings settings_;
  const base::BackOff back_off_;
  std::int64_t failures_ = 0;  // attempts since the last success
  std::minstd_rand random_{std::random_device{}()};

  std::mutex handle_mutex_;  // guards the handle, between its user and its network thread
  mosquitto* handle_ = nullptr;
  Clock::time_point leave_by_;
  bool goodbye_said_ = false;
  std::atomic<std::size_t> waiting_{0};
  std::atomic<bool> connected_{false};
  std::atomic<bool> leaving_{false};

  // For the network thread only.
  bool first_ = true;
  std::size_t ungranted_ = 0;  // subscriptions that are not granted yet
  std::string why_;

  std::mutex mutex_;  // guards the members below
  std::condition_variable changed_;
  std::deque<Event> events_;
  bool wanted_ = false;  // a connection is requested
  std::optional<Message> will_;
  bool quit_ = false;
  base::Thread thread_;
};

}  // namespace loopwarden::mqtt
