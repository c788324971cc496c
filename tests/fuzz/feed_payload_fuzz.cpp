// SPDX-License-Identifier: Apache-2.0
// Delivers any bytes to loopwarden-feed: as a plain topic by each kind of rule, and as each message
// of a foreign edge node's life. The resulting lines must be valid for feed.sock.
#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "daemon/protocol/feed_line.hpp"
#include "services/feed/values/foreign_edges.hpp"
#include "services/feed/values/topics.hpp"
#include "tests/fuzz/require.hpp"

namespace {

using namespace loopwarden;
using protocol::FedValue;
using sparkplug::MessageType;
using tests::fuzz::require;

// The daemon reads each value as the feeder sent it.
void check(const std::vector<FedValue>& values) {
  std::size_t read = 0;
  for (const std::string& line : protocol::write_feed_lines(values)) {
    require(line.find('\n') == std::string::npos, "one line");
    std::string id;
    for (const FedValue& fed : protocol::read_feed_line(line, id).values) {
      const FedValue& meant = values.at(read++);
      require(fed.name == meant.name && fed.value == meant.value && fed.time_s == meant.time_s &&
                  fed.quality == meant.quality && fed.reason == meant.reason,
              "the same");
    }
  }
  require(read == values.size(), "all of them");
}

std::vector<feed::TopicRule> topic_rules() {
  const auto at = [](const char* text) { return feed::JsonPointer(text); };
  return {{.name = "number", .topic = "t"},
          {.name = "whole", .topic = "t", .payload = {.value = at("")}},
          {.name = "s",
           .topic = "t",
           .payload = {.value = at("/v"), .time = at("/t"), .quality = at("/q")}},
          {.name = "ms",
           .topic = "t",
           .payload = {.value = at("/v/0"), .time = at("/t"), .time_form = feed::TimeForm::ms}},
          {.name = "iso",
           .topic = "t",
           .payload = {.value = at("/v"),
                       .time = at("/t"),
                       .time_form = feed::TimeForm::iso,
                       .quality = at("/q"),
                       .quality_codes = feed::QualityCodes::opc_ua}}};
}

void plain(std::string_view bytes) {
  feed::Topics topics(topic_rules());
  std::vector<FedValue> values;
  std::string complaint;
  topics.take("t", bytes, false, 0, values, complaint);
  require(values.size() == 5, "a value of each rule, if a bad one");
  topics.disconnected(values);
  check(values);
}

void live(std::string_view bytes) {
  feed::ForeignEdges edges({{"node", "g", "e", "", "pv"}, {"device", "g", "e", "d", "pv"}});
  std::vector<FedValue> values;
  std::string complaint;
  const auto say = [&](MessageType type, const char* device) {
    edges.take({"g", type, "e", device}, bytes, 0, values, complaint);
  };
  say(MessageType::nbirth, "");
  say(MessageType::dbirth, "d");
  say(MessageType::ddata, "d");
  say(MessageType::ndata, "");
  say(MessageType::ddeath, "d");
  say(MessageType::ndeath, "");
  edges.look(60'000, values);
  edges.disconnected(values);
  check(values);
}

sparkplug::Metric metric(const char* name, sparkplug::DataType type, sparkplug::Value value) {
  sparkplug::Metric made;
  made.name = name;
  made.type = type;
  made.value = std::move(value);
  return made;
}

// Any bytes are sent as the death of a live node. All its values become bad, unless the death is
// readable and of another connection.
void death(std::string_view bytes) {
  using sparkplug::DataType;
  feed::ForeignEdges edges({{"node", "g", "e", "", "pv"}});
  std::vector<FedValue> values;
  std::string complaint;
  const std::string birth =
      sparkplug::encode({.time_ms = 1,
                         .seq = std::uint64_t{0},
                         .metrics = {metric("bdSeq", DataType::uint64, std::uint64_t{3}),
                                     metric("pv", DataType::float64, 1.5)}},
                        sparkplug::Types::sent);
  edges.take({"g", MessageType::nbirth, "e", ""}, birth, 0, values, complaint);
  require(values.size() == 1 && values[0].value == 1.5, "born");
  values.clear();
  edges.take({"g", MessageType::ndeath, "e", ""}, bytes, 0, values, complaint);
  if (values.empty()) {
    const sparkplug::Payload payload = sparkplug::decode(bytes);
    const sparkplug::Metric* bd_seq = payload.find("bdSeq");
    require(bd_seq != nullptr && sparkplug::number_of(bd_seq->value) != 3.0, "of another one");
  } else {
    require(values.size() == 1 && values[0].quality == FedValue::Quality::bad, "dead");
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  plain(bytes);
  live(bytes);
  death(bytes);
  return 0;
}
