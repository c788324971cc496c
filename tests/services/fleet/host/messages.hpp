// SPDX-License-Identifier: Apache-2.0
// Messages of a simulated edge node, as payloads and as delivered by a broker.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "services/fleet/host/spool.hpp"
#include "services/net/sparkplug/payload.hpp"
#include "services/net/sparkplug/topic.hpp"

namespace loopwarden::tests {

inline constexpr std::uint64_t kNoon = 1'795'521'600'000;  // 2026-11-24 12:00 UTC, ms

inline sparkplug::Metric metric(std::string name, sparkplug::DataType type, sparkplug::Value value,
                                std::optional<std::uint64_t> time_ms = std::nullopt,
                                std::optional<std::uint64_t> alias = std::nullopt) {
  sparkplug::Metric made;
  made.name = std::move(name);
  made.type = type;
  made.value = std::move(value);
  made.time_ms = time_ms;
  made.alias = alias;
  return made;
}

// A box A/box1 with one loop FIC-101. It numbers its messages.
class EdgeMessages {
 public:
  explicit EdgeMessages(std::string edge = "box1") : edge_(std::move(edge)) {}

  std::uint64_t bd_seq = 0;
  std::uint64_t time_ms = kNoon;

  fleet::Arrival nbirth() {
    seq_ = 0;
    return message(
        sparkplug::MessageType::nbirth, "",
        {bd_seq_metric(), metric("version", sparkplug::DataType::string, std::string("0.2.0"))});
  }
  fleet::Arrival ndeath() {
    sparkplug::Payload payload;
    payload.metrics = {bd_seq_metric()};
    return arrival(sparkplug::MessageType::ndeath, "", payload);
  }
  // pv (alias 1), mode (2), an alarm's state (3) and severity (4), a process alarm's state (7),
  // tag. Values carry the time of their measurement, also in a birth.
  fleet::Arrival dbirth(double pv = 1.0, std::uint64_t taken_ms = 0) {
    using sparkplug::DataType;
    sparkplug::Metric with_range =
        metric("pv", DataType::float64, pv, taken_ms == 0 ? time_ms : taken_ms, 1);
    with_range.properties = {{"unit", DataType::string, std::string("L/min")},
                             {"engLow", DataType::float64, 0.0},
                             {"engHigh", DataType::float64, 10.0}};
    return message(
        sparkplug::MessageType::dbirth, "FIC-101",
        {with_range, metric("mode", DataType::string, std::string("automatic"), time_ms, 2),
         metric("alarm/stiction/state", DataType::uint16, std::uint64_t{0}, time_ms, 3),
         metric("alarm/stiction/severity", DataType::float64, 0.0, time_ms, 4),
         metric("explanation/effect", DataType::string, std::string(""), time_ms, 5),
         metric("condition/valve", DataType::float64, 97.0, time_ms, 6),
         metric("alarm/bad_pv/state", DataType::string, std::string("normal"), time_ms, 7),
         metric("tag", DataType::string, std::string("10-FIC/101"))});
  }
  fleet::Arrival birth_of(std::vector<sparkplug::Metric> metrics) {
    return message(sparkplug::MessageType::dbirth, "FIC-101", std::move(metrics));
  }
  fleet::Arrival ddeath() { return message(sparkplug::MessageType::ddeath, "FIC-101", {}); }
  fleet::Arrival data(std::vector<sparkplug::Metric> metrics) {
    return message(sparkplug::MessageType::ddata, "FIC-101", std::move(metrics));
  }
  fleet::Arrival pv(double value, bool historical = false, std::uint64_t taken_ms = 0) {
    sparkplug::Metric one =
        metric("", sparkplug::DataType::unknown, value, taken_ms == 0 ? time_ms : taken_ms, 1);
    one.historical = historical;
    return data({one});
  }
  void skip() { ++seq_; }  // loses a message

 private:
  sparkplug::Metric bd_seq_metric() const {
    return metric("bdSeq", sparkplug::DataType::uint64, bd_seq);
  }
  fleet::Arrival message(sparkplug::MessageType type, const std::string& device,
                         std::vector<sparkplug::Metric> metrics) {
    sparkplug::Payload payload;
    payload.seq = seq_++;
    payload.time_ms = time_ms++;
    payload.metrics = std::move(metrics);
    return arrival(type, device, payload);
  }
  fleet::Arrival arrival(sparkplug::MessageType type, const std::string& device,
                         const sparkplug::Payload& payload) const {
    return {to_text(sparkplug::Topic{"A", type, edge_, device}),
            encode(payload, sparkplug::Types::sent), static_cast<std::int64_t>(time_ms), false};
  }

  std::string edge_;
  std::uint8_t seq_ = 0;
};

}  // namespace loopwarden::tests
