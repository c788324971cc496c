// SPDX-License-Identifier: Apache-2.0
// A simulated box: a Sparkplug edge node whose loops send counters as values, so that lost or
// doubled values can be found in the database. It keeps the values of the last minute, as
// loopwarden-edge does. When broker or host return, it sends them again, marked historical.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "services/net/mqtt/client.hpp"
#include "services/net/sparkplug/edge_session.hpp"
#include "services/net/sparkplug/payload.hpp"
#include "services/net/sparkplug/topic.hpp"

namespace loopwarden::bench {

struct BoxSettings {
  mqtt::BrokerUrl broker;
  std::string group;
  std::string edge;
  std::string host;           // primary host
  std::string client_suffix;  // allows two connected edge nodes of one name
  int loops = 20;
  std::int64_t period_ms = 10'000;  // of each loop
  std::int64_t offset_ms = 0;       // time of the first loop's first message
  std::int64_t count_from = 0;      // the first value of each loop is one larger
  int births_to_lose = 0;           // number of DBIRTHs of the first loop that are not sent
};

struct Sample {
  std::int64_t time_ms = 0;
  int loop = 0;
  std::int64_t number = 0;
  std::int64_t sent_ms = 0;  // 0: not yet sent
};

class Box {
 public:
  explicit Box(BoxSettings settings);

  // Does the work that is due; `sample`: also takes new values.
  void tick(std::int64_t now_ms, bool sample);
  void leave() { client_.leave(); }

  bool drained() const;
  bool live() const noexcept { return session_.live(); }
  std::size_t stored() const;
  std::int64_t sent() const noexcept { return sent_; }
  std::int64_t sent_again() const noexcept { return sent_again_; }
  std::int64_t births() const noexcept { return births_; }
  std::int64_t newest_number(int loop) const { return numbers_[static_cast<std::size_t>(loop)]; }
  const BoxSettings& settings() const noexcept { return settings_; }

 private:
  void handle(const mqtt::Event& event, std::int64_t now_ms);
  void hear(const mqtt::Message& message, std::int64_t now_ms);
  void follow(sparkplug::EdgeSession::Next next, std::int64_t now_ms);
  void connect();
  void lost(std::int64_t now_ms);
  void give_birth(std::int64_t now_ms);
  void take_samples(std::int64_t now_ms);
  void send_waiting(std::int64_t now_ms);
  bool send(Sample& sample, bool historical, std::int64_t now_ms);
  bool publish(sparkplug::MessageType type, const std::string& device, sparkplug::Payload payload,
               sparkplug::Types types);
  std::vector<sparkplug::Metric> device_birth(int loop) const;

  BoxSettings settings_;
  sparkplug::EdgeSession session_;
  mqtt::Client client_;
  std::optional<mqtt::Message> early_state_;  // from the host, before the connection counts
  std::deque<Sample> samples_;                // ordered by time
  std::vector<std::int64_t> numbers_;
  std::vector<std::int64_t> times_ms_;  // of the newest sample of each loop
  std::vector<std::int64_t> due_ms_;
  std::size_t waiting_from_ = 0;  // index in samples_; earlier ones have been sent
  std::int64_t sent_ = 0;
  std::int64_t sent_again_ = 0;
  std::int64_t births_ = 0;
};

}  // namespace loopwarden::bench
