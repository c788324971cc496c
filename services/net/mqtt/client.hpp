// SPDX-License-Identifier: Apache-2.0
// A connection to an MQTT 3.1.1 broker (libmosquitto) that never makes its user wait: the network has a thread of its
// own, what happens there is fetched as events.
//
//   client.connect(will)          one attempt, after the wait that failed ones before it ask for
//   for (Event& e : client.events(1s)) ...   connected | message ... | disconnected; then connect() again
//
// A broker that accepts and then says nothing is found by keep-alive: the connection is given up after one to two
// keep-alive times, also while it is being made. What can't be told: whether a message of QoS 0 that was written to
// the network has come to the broker.
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
#include <string_view>
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

// Files and secrets are read anew at each connection, so that a renewed certificate needs no restart.
struct ClientSettings {
  BrokerUrl broker;
  std::string client_id;  // unique at the broker
  std::string user;       // empty: none
  base::Secret password;
  std::string ca_file;           // of TLS; empty: those of the system
  std::string certificate_file;  // the client's own; empty: none
  base::Secret key;
  std::chrono::seconds keep_alive{15};  // at least 5: libmosquitto
  std::chrono::milliseconds reconnect_min{1000};
  std::chrono::milliseconds reconnect_max{60'000};
  std::size_t most_waiting = 200;     // see waiting()
  std::size_t most_events = 100'000;  // not fetched; then the network waits
  std::vector<Subscription>
      subscriptions;  // of every connection, granted before it counts as connected
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
  std::string why;  // of disconnected
};

class Client {
 public:
  // Throws std::runtime_error if there is no thread to be had.
  explicit Client(ClientSettings settings);
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;
  // Without a goodbye: the broker publishes the will. Waits for a name server that hangs.
  ~Client();

  // After the start and after each `disconnected`: tries once, with this will. Clean session.
  void connect(std::optional<Message> will);
  // Says goodbye (no will) once nothing is waiting, for 2 s at most: a connection that ends with a confirmation on its
  // way is to a broker one that broke. `disconnected` follows, also where the broker hangs. The wait before the next
  // attempt is the shortest again. Without a connection nothing happens.
  void leave();

  // False, and nothing is sent: not connected, or too many are waiting.
  bool publish(const Message& message);
  // Messages handed over and not yet on the network (QoS 0) or confirmed (QoS 1).
  std::size_t waiting() const noexcept { return waiting_.load(std::memory_order_relaxed); }
  bool connected() const noexcept { return connected_.load(std::memory_order_relaxed); }

  // What has happened, in order; waits for at most `patience` until there is something.
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

  std::mutex handle_mutex_;  // of what follows: the handle's user and its network thread
  mosquitto* handle_ = nullptr;
  Clock::time_point leave_by_;
  bool goodbye_said_ = false;
  std::atomic<std::size_t> waiting_{0};
  std::atomic<bool> connected_{false};
  std::atomic<bool> leaving_{false};

  // Of the network thread.
  bool first_ = true;
  std::size_t ungranted_ = 0;  // subscriptions
  std::string why_;

  std::mutex mutex_;  // of what follows
  std::condition_variable changed_;
  std::deque<Event> events_;
  bool wanted_ = false;  // a connection
  std::optional<Message> will_;
  bool quit_ = false;
  base::Thread thread_;
};

}  // namespace loopwarden::mqtt
