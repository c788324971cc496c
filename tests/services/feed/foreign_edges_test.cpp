// SPDX-License-Identifier: Apache-2.0
#include "services/feed/values/foreign_edges.hpp"

#include <catch2/catch.hpp>

#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace foreign_edges_test {

using namespace loopwarden;
using feed::ForeignEdges;
using feed::MetricRule;
using protocol::FedValue;
using sparkplug::DataType;
using sparkplug::MessageType;
using sparkplug::Metric;
using sparkplug::Value;
using Quality = FedValue::Quality;

Metric metric(const std::string& name, std::optional<std::uint64_t> alias, DataType type,
              Value value, std::uint64_t time_ms = 1000) {
  Metric made;
  made.name = name;
  made.alias = alias;
  made.time_ms = time_ms;
  made.type = type;
  made.value = std::move(value);
  return made;
}

const std::vector<MetricRule> kRules{
    {"PV", "g", "e", "d", "PV"}, {"MODE", "g", "e", "d", "MODE"}, {"T", "g", "e", "", "T"}};

// An edge node and the values derived from its messages.
struct Foreign {
  explicit Foreign(const std::vector<MetricRule>& rules = kRules) : edges(rules) {}

  std::map<std::string, FedValue> say(MessageType type, const std::string& device,
                                      std::vector<Metric> metrics, sparkplug::Types types,
                                      std::optional<std::uint64_t> number = std::nullopt) {
    if (type == MessageType::nbirth || type == MessageType::ndeath) {
      metrics.push_back(metric("bdSeq", {}, DataType::int64, bd_seq));
    }
    if (type == MessageType::nbirth) seq = 0;
    sparkplug::Payload payload{.time_ms = ++time_ms, .seq = {}, .metrics = std::move(metrics)};
    if (type != MessageType::ndeath) payload.seq = number ? *number : seq++ % 256;
    values.clear();
    complaint.clear();
    edges.take({"g", type, "e", device}, sparkplug::encode(payload, types), now_ms, values,
               complaint);
    return by_name();
  }
  std::map<std::string, FedValue> by_name() const {
    std::map<std::string, FedValue> all;
    for (const FedValue& fed : values) all[fed.name] = fed;
    return all;
  }
  void node_birth() {
    say(MessageType::nbirth, "", {metric("T", 1, DataType::float64, 20.5)}, sparkplug::Types::sent);
  }
  std::map<std::string, FedValue> device_birth(std::uint64_t pv_alias = 7) {
    return say(MessageType::dbirth, "d",
               {metric("PV", pv_alias, DataType::float32, 1.5),
                metric("MODE", 8, DataType::int16, std::int64_t{1}),
                metric("other", 9, DataType::string, std::string("x"))},
               sparkplug::Types::sent);
  }
  std::map<std::string, FedValue> pv(double value, std::uint64_t alias = 7) {
    return say(MessageType::ddata, "d", {metric("", alias, DataType::float32, value)},
               sparkplug::Types::left_out);
  }
  std::map<std::string, FedValue> look() {
    values.clear();
    edges.look(now_ms, values);
    return by_name();
  }

  ForeignEdges edges;
  std::int64_t bd_seq = 3;
  std::uint64_t seq = 0;
  std::uint64_t time_ms = 5000;
  std::int64_t now_ms = 0;
  std::vector<FedValue> values;
  std::string complaint;
};

TEST_CASE("births give values, types and aliases; data has only aliases, without types", "[feed]") {
  Foreign edge;
  CHECK(edge.pv(9.0).empty());  // no birth yet
  CHECK(edge.edges.counts().dropped == 1);
  edge.node_birth();
  CHECK(edge.by_name().at("T").value == 20.5);
  auto born = edge.device_birth();
  CHECK(born.size() == 2);
  CHECK(born.at("PV").value == 1.5);
  CHECK(born.at("PV").time_s == 1.0);
  CHECK(born.at("MODE").value == 1.0);
  CHECK(edge.pv(2.5).at("PV").value == 2.5);
  // Only the type in the birth gives the sign of a whole number.
  const auto mode =
      edge.say(MessageType::ddata, "d", {metric("", 8, DataType::int16, std::int64_t{-2})},
               sparkplug::Types::left_out);
  CHECK(mode.at("MODE").value == -2.0);
  // By name as well.
  CHECK(edge.say(MessageType::ndata, "", {metric("T", {}, DataType::float64, 21.0)},
                 sparkplug::Types::sent)
            .at("T")
            .value == 21.0);
  // Other metrics and other devices are ignored.
  CHECK(edge.say(MessageType::ddata, "d", {metric("", 9, DataType::string, std::string("y"))},
                 sparkplug::Types::sent)
            .empty());
  CHECK(edge.say(MessageType::dbirth, "d2", {metric("PV", 70, DataType::float32, 1.0)},
                 sparkplug::Types::sent)
            .empty());
  CHECK(edge.edges.counts().unknown == 1);
  CHECK(edge.edges.counts().missing == 0);
}

TEST_CASE("a new birth can change the aliases; the old ones are invalid", "[feed]") {
  Foreign edge;
  edge.node_birth();
  edge.device_birth(7);
  edge.node_birth();
  CHECK(edge.pv(5.0).empty());  // the device is not born again yet
  edge.device_birth(17);
  CHECK(edge.pv(5.0, 7).empty());
  CHECK(edge.pv(6.0, 17).at("PV").value == 6.0);
}

TEST_CASE("the death of a device makes its values bad, and that of a node makes all bad",
          "[feed]") {
  Foreign edge;
  edge.node_birth();
  edge.device_birth();
  auto dead = edge.say(MessageType::ddeath, "d", {}, sparkplug::Types::sent);
  CHECK(dead.size() == 2);
  CHECK(dead.at("PV").quality == Quality::bad);
  CHECK_FALSE(dead.at("PV").value);
  CHECK(edge.pv(1.0).empty());
  edge.device_birth();
  // The will of an older connection arrives late.
  edge.bd_seq = 2;
  CHECK(edge.say(MessageType::ndeath, "", {}, sparkplug::Types::sent).empty());
  edge.bd_seq = 3;
  dead = edge.say(MessageType::ndeath, "", {}, sparkplug::Types::sent);
  CHECK(dead.size() == 3);
  for (const auto& [name, fed] : dead) {
    CHECK(fed.quality == Quality::bad);
    CHECK(fed.source == "edge node g/e");
  }
  CHECK(edge.edges.counts().deaths == 2);
  edge.bd_seq = 4;
  edge.node_birth();
  CHECK(edge.device_birth().at("PV").quality == Quality::good);
}

TEST_CASE("an edge node that is not born after the broker is there is dead", "[feed]") {
  Foreign edge;
  edge.edges.connected(edge.now_ms);
  edge.now_ms += ForeignEdges::kDeviceWaitMs + 1;
  const auto dead = edge.look();
  REQUIRE(dead.contains("PV"));
  CHECK(dead.at("PV").reason == FedValue::Reason::death);
  CHECK(dead.at("PV").source == "edge node g/e");
  CHECK(edge.look().empty());
}

TEST_CASE("after a node's new birth a device without a new birth is dead", "[feed]") {
  Foreign edge;
  edge.node_birth();
  edge.device_birth();
  edge.node_birth();
  edge.now_ms += ForeignEdges::kDeviceWaitMs;
  CHECK(edge.look().empty());
  edge.now_ms += 1;
  const auto dead = edge.look();
  CHECK(dead.size() == 2);
  CHECK(dead.at("PV").quality == Quality::bad);
  CHECK(edge.look().empty());
}

TEST_CASE("historical values are not used as present ones; null, NaN and text are bad", "[feed]") {
  Foreign edge;
  edge.node_birth();
  edge.device_birth();
  Metric old = metric("", 7, DataType::float32, 9.0);
  old.historical = true;
  CHECK(edge.say(MessageType::ddata, "d", {old}, sparkplug::Types::sent).empty());
  CHECK(edge.edges.counts().historical == 1);
  const auto of = [&](Value value, DataType type) {
    return edge
        .say(MessageType::ddata, "d", {metric("", 7, type, std::move(value))},
             sparkplug::Types::sent)
        .at("PV");
  };
  CHECK(of(std::monostate{}, DataType::float32).quality == Quality::bad);
  CHECK(of(std::nan(""), DataType::float32).quality == Quality::bad);
  CHECK(edge.edges.counts().bad_payloads == 0);
  CHECK(of(std::string("AUTO"), DataType::string).word == "AUTO");
  CHECK(of(std::string(65, 'A'), DataType::string).quality == Quality::bad);
  CHECK(edge.edges.counts().bad_payloads == 1);
  CHECK(edge.complaint == "a value for PV is no number and no word");
  CHECK(of(true, DataType::boolean).value == 1.0);
}

TEST_CASE("the property Quality gives the value's quality", "[feed]") {
  Foreign edge;
  edge.node_birth();
  edge.device_birth();
  const auto with = [&](std::int64_t code) {
    Metric one = metric("", 7, DataType::float32, 3.0);
    one.properties.push_back({.key = "Quality", .type = DataType::int32, .value = code});
    return edge.say(MessageType::ddata, "d", {one}, sparkplug::Types::sent).at("PV").quality;
  };
  CHECK(with(192) == Quality::good);
  CHECK(with(500) == Quality::bad);
  CHECK(with(0) == Quality::bad);
  CHECK(with(64) == Quality::uncertain);
}

TEST_CASE("after missing messages the whole edge node is uncertain until it publishes again",
          "[feed]") {
  Foreign edge;
  edge.node_birth();
  edge.device_birth();
  ++edge.seq;                   // one is lost
  CHECK(edge.pv(4.0).empty());  // waits for the message before it
  edge.now_ms += 10'000;
  const auto now = edge.look();
  CHECK(now.at("MODE").quality == Quality::uncertain);
  CHECK(now.at("MODE").value == 1.0);
  CHECK(now.at("T").quality == Quality::uncertain);
  CHECK(now.at("PV").quality == Quality::good);
  CHECK(now.at("PV").value == 4.0);
  CHECK(edge.edges.counts().missing == 1);
  CHECK(edge.look().empty());
  CHECK(edge.say(MessageType::ddata, "d", {metric("", 8, DataType::int16, std::int64_t{1})},
                 sparkplug::Types::sent)
            .at("MODE")
            .quality == Quality::good);
}

TEST_CASE("missing births are requested, less and less often", "[feed]") {
  Foreign edge;
  CHECK(edge.edges.to_ask(0) == std::vector<ForeignEdges::EdgeName>{{"g", "e"}});
  CHECK(edge.edges.to_ask(4'999).empty());
  CHECK(edge.edges.to_ask(5'000).size() == 1);
  CHECK(edge.edges.to_ask(14'999).empty());
  CHECK_FALSE(edge.edges.all_born());
  edge.now_ms = 20'000;
  edge.node_birth();
  CHECK(edge.edges.all_born());
  edge.device_birth();
  CHECK(edge.edges.to_ask(100'000).empty());
  // After long unanswered requests, a new connection allows a request at once.
  ++edge.seq;
  edge.pv(3.0);
  edge.now_ms = 200'000;
  edge.look();
  CHECK(edge.edges.to_ask(200'000).size() == 1);
  CHECK(edge.edges.to_ask(200'001).empty());
  edge.values.clear();
  edge.edges.disconnected(edge.values);
  CHECK(edge.by_name().at("PV").quality == Quality::bad);
  CHECK(edge.by_name().at("PV").reason == FedValue::Reason::link);
  CHECK(edge.pv(2.0).empty());
  CHECK(edge.edges.to_ask(200'002).size() == 1);
  const sparkplug::Payload request = sparkplug::decode(feed::rebirth_request(5));
  REQUIRE(request.metrics.size() == 1);
  CHECK(request.metrics[0].name == "Node Control/Rebirth");
  CHECK(request.metrics[0].value == Value(true));
  CHECK_FALSE(request.seq);
}

TEST_CASE("a birth without the metric, an invalid payload, and unknown edge nodes", "[feed]") {
  Foreign edge;
  edge.node_birth();
  const auto born = edge.say(MessageType::dbirth, "d", {metric("PV", 7, DataType::float32, 1.5)},
                             sparkplug::Types::sent);
  CHECK(born.at("MODE").quality == Quality::bad);
  CHECK(edge.complaint == "spBv1.0/g/DBIRTH/e/d: no metric 'MODE'");
  std::vector<FedValue> values;
  std::string complaint;
  edge.edges.take({"g", MessageType::ddata, "e", "d"}, "\xff\xff", 0, values, complaint);
  REQUIRE(values.size() == 1);  // it may have had a newer value
  CHECK(values[0].name == "PV");
  CHECK(values[0].quality == Quality::uncertain);
  CHECK_THAT(complaint, Catch::StartsWith("spBv1.0/g/DDATA/e/d: "));
  CHECK(edge.edges.counts().bad_payloads == 1);
  edge.edges.take({"g", MessageType::ddata, "stranger", "d"}, "", 0, values, complaint);
  CHECK(edge.edges.counts().unknown == 1);
}

TEST_CASE(
    "a death that can't be matched makes all values of the node bad, and a rebirth is requested",
    "[feed]") {
  const auto death = [](std::vector<Metric> metrics) {
    return sparkplug::encode({.time_ms = 9, .seq = {}, .metrics = std::move(metrics)},
                             sparkplug::Types::sent);
  };
  const std::vector<std::string> payloads{
      death({}),
      death({metric("", 9, DataType::int64, std::int64_t{3})}),  // an alias that is in no birth
      death({metric("bdSeq", {}, DataType::string, std::string("3"))}),
      death({metric("bdSeq", {}, DataType::float64, 3.0)}),
      "\xff\xff",
      ""};
  for (const std::string& payload : payloads) {
    Foreign edge;
    edge.node_birth();
    edge.device_birth();
    CHECK(edge.edges.to_ask(0).empty());
    edge.values.clear();
    edge.edges.take({"g", MessageType::ndeath, "e", ""}, payload, 0, edge.values, edge.complaint);
    const auto dead = edge.by_name();
    CHECK(dead.size() == 3);
    for (const auto& [name, fed] : dead) {
      CHECK(fed.quality == Quality::bad);
      CHECK(fed.reason == FedValue::Reason::death);
    }
    CHECK_THAT(edge.complaint, Catch::Contains("bdSeq can't be read"));
    CHECK(edge.edges.to_ask(1).size() == 1);
    CHECK(edge.pv(4.0).empty());
    edge.node_birth();
    CHECK(edge.device_birth().at("PV").quality == Quality::good);
  }
}

TEST_CASE("an unreadable birth or death of a device makes the device's values bad", "[feed]") {
  struct Refused {
    MessageType type;
    std::string device;
    std::size_t values;
  };
  for (const Refused& refused :
       {Refused{MessageType::ddeath, "d", 2}, Refused{MessageType::dbirth, "d", 2},
        Refused{MessageType::nbirth, "", 3}}) {
    for (const bool decodes : {true, false}) {
      Foreign edge;
      edge.node_birth();
      edge.device_birth();
      edge.values.clear();
      const std::string without_seq =
          sparkplug::encode({.time_ms = 9, .seq = {}, .metrics = {}}, sparkplug::Types::sent);
      edge.edges.take({"g", refused.type, "e", refused.device}, decodes ? without_seq : "\xff\xff",
                      0, edge.values, edge.complaint);
      CHECK(edge.by_name().size() == refused.values);
      CHECK(edge.by_name().at("PV").quality == Quality::bad);
      CHECK_FALSE(edge.complaint.empty());
      CHECK(edge.edges.to_ask(1).size() == 1);
      CHECK(edge.pv(4.0).empty());
    }
  }
}

TEST_CASE("a refused birth is reported with the reason", "[feed]") {
  const auto complaint = [](std::optional<std::uint64_t> seq, std::vector<Metric> metrics) {
    Foreign edge;
    edge.edges.take({"g", MessageType::nbirth, "e", ""},
                    sparkplug::encode({.time_ms = 9, .seq = seq, .metrics = std::move(metrics)},
                                      sparkplug::Types::sent),
                    0, edge.values, edge.complaint);
    return edge.complaint;
  };
  const Metric good = metric("bdSeq", {}, DataType::int64, std::int64_t{3});
  CHECK_THAT(complaint({}, {good}), Catch::EndsWith("refused, it has no seq"));
  CHECK_THAT(complaint(4, {good}), Catch::Contains("its seq is 4"));
  CHECK_THAT(complaint(0, {}), Catch::EndsWith("it has no metric bdSeq"));
  CHECK_THAT(complaint(0, {metric("bdSeq", {}, DataType::string, std::string("3"))}),
             Catch::Contains("whole number from 0 to 255"));
  CHECK(complaint(0, {good}).find("refused") == std::string::npos);
}

TEST_CASE(
    "a birth is requested of an edge node that is silent without a death, then its values are bad",
    "[feed]") {
  Foreign edge(
      {{.name = "PV",
        .group = "g",
        .edge = "e",
        .device = "d",
        .metric = "PV",
        .timeout_ms = 10'000},
       {.name = "T", .group = "g", .edge = "e", .device = "", .metric = "T", .timeout_ms = 0}});
  edge.node_birth();
  edge.device_birth();
  edge.now_ms = 5'000;
  CHECK(edge.look().empty());
  CHECK(edge.edges.to_ask(edge.now_ms).empty());
  edge.now_ms = 5'001;
  CHECK(edge.look().empty());
  CHECK(edge.edges.to_ask(edge.now_ms).size() == 1);
  edge.now_ms = 10'001;
  const auto silent = edge.look();
  REQUIRE(silent.size() == 1);
  CHECK(silent.at("PV").quality == Quality::bad);
  CHECK(silent.at("PV").reason == FedValue::Reason::timeout);
  CHECK(edge.look().empty());
  // No message is missing. Its earlier values are valid again with its next message, of any metric.
  const auto again = edge.say(MessageType::ndata, "", {metric("T", {}, DataType::float64, 21.0)},
                              sparkplug::Types::sent);
  CHECK(again.at("PV").value == 1.5);
  CHECK(again.at("PV").quality == Quality::good);
  CHECK(edge.edges.counts().timeouts == 1);
}

TEST_CASE("births of many edge nodes are requested one after the other", "[feed]") {
  std::vector<MetricRule> rules;
  for (int i = 0; i < 100; ++i) {
    rules.push_back({"PV" + std::to_string(i), "g", "e" + std::to_string(i), "d", "PV"});
  }
  ForeignEdges edges(rules);
  CHECK(edges.to_ask(0).size() == 20);
  std::size_t asked = 20;
  for (std::int64_t now_ms = 100; now_ms < 20'000; now_ms += 100) {
    const std::size_t more = edges.to_ask(now_ms).size();
    CHECK(more <= 1);
    asked += more;
  }
  CHECK(asked >= 100);
}

TEST_CASE("one metric may have several names", "[feed]") {
  Foreign edge({{"A", "g", "e", "d", "PV"}, {"B", "g", "e", "d", "PV"}});
  edge.node_birth();
  const auto born = edge.device_birth();
  CHECK(born.at("A").value == 1.5);
  CHECK(born.at("B").value == 1.5);
}

}  // namespace foreign_edges_test
