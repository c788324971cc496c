// SPDX-License-Identifier: Apache-2.0
// Sparkplug B edge nodes of others, as far as rules name their metrics: what their messages mean
// for feed.sock. Pure: the caller gives the time.
//
// A value counts from the birth that names its metric until a death. Data that comes before the
// birth is left out, so are historical values. Where messages are missing, what they said is not
// known: all of that edge node is uncertain until it says it again. A device that an NBIRTH does
// not bring back within kDeviceWaitMs is dead.
//
// A death or a birth that can't be understood ends the values of all that it may mean, and a birth
// is asked for. An edge node that is silent is asked for a birth after half the timeout of its
// metrics. After the whole timeout its values are bad until it says something; then they hold
// again, unless messages are missing.
//
// What it can't do: read data of an edge node whose birth came before this connection; it must be
// born again.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "services/net/sparkplug/edge_tracker.hpp"
#include "services/net/sparkplug/payload.hpp"
#include "services/net/sparkplug/rebirth_policy.hpp"
#include "services/net/sparkplug/topic.hpp"
#include "daemon/protocol/feed_line.hpp"

namespace loopwarden::feed {

struct MetricRule {
  std::string name;  // on feed.sock
  std::string group;
  std::string edge;
  std::string device;  // empty: of the edge node itself
  std::string metric;
  std::int64_t timeout_ms = 300'000;  // no message of the edge node for longer: bad; 0: never
};

class ForeignEdges {
 public:
  static constexpr std::int64_t kDeviceWaitMs = 10'000;

  struct Counts {
    std::uint64_t bad_payloads =
        0;                      // no Sparkplug; or a metric's value that is no number and no word
    std::uint64_t unknown = 0;  // messages of edge nodes and devices of no rule
    std::uint64_t dropped = 0;  // without a birth, doubled, of an older connection
    std::uint64_t historical = 0;  // values
    std::uint64_t missing = 0;     // messages
    std::uint64_t deaths = 0;
    std::uint64_t timeouts = 0;  // of values
  };
  using EdgeName = std::pair<std::string, std::string>;  // group, edge

  explicit ForeignEdges(const std::vector<MetricRule>& rules);

  // Appends the values that now count. What is wrong with the message goes to `complaint`.
  void take(const sparkplug::Topic& topic, std::string_view payload, std::int64_t now_ms,
            std::vector<protocol::FedValue>& values, std::string& complaint);
  // Appends what is no longer waited for.
  void look(std::int64_t now_ms, std::vector<protocol::FedValue>& values);
  // The broker is away: births must come anew. Appends bad values of all that were known.
  void disconnected(std::vector<protocol::FedValue>& values);

  // Edge nodes whose birth is missing and may be asked for now. They count as asked.
  std::vector<EdgeName> to_ask(std::int64_t now_ms);
  std::vector<EdgeName> edges() const;
  bool all_born() const noexcept;

  Counts counts() const noexcept;

 private:
  using Values = std::vector<protocol::FedValue>;
  struct Metric {
    sparkplug::DataType type = sparkplug::DataType::unknown;  // of the birth
    protocol::FedValue newest{.quality = protocol::FedValue::Quality::bad};
    std::int64_t timeout_ms = 0;
    bool silent = false;  // its timeout has passed
  };
  struct Device {
    bool born = false;
    std::optional<std::int64_t> awaited_since_ms{};  // its node was born, it was not yet
    std::map<std::string, std::vector<Metric>>
        metrics;  // by their name; a value may have several names
    std::unordered_map<std::uint64_t, std::vector<Metric>*> by_alias;
  };
  struct Edge {
    sparkplug::EdgeTracker tracker{};
    sparkplug::RebirthWait rebirth{};
    std::uint64_t missing = 0;              // so many are known to the values
    std::int64_t heard_ms = 0;              // newest message
    std::map<std::string, Device> devices;  // "": the node
  };

  void apply(Edge& edge, const sparkplug::Message& message, std::int64_t now_ms, Values& values,
             std::string& complaint);
  void node_born(Edge& edge, std::int64_t now_ms);
  void born(Device& device, const sparkplug::Message& message, Values& values,
            std::string& complaint);
  void data(Edge& edge, Device& device, const sparkplug::Message& message, Values& values,
            std::string& complaint);
  void say(std::vector<Metric>& metrics, const sparkplug::Metric& said,
           const sparkplug::Payload& payload, Values& values, std::string& complaint);
  static void doubt_after_gap(Edge& edge, Values& values);
  static void doubt(Device& device, Values& values);
  // A message that can't be understood.
  static void refuse(Edge& edge, const sparkplug::Topic& topic, Values& values);
  static void heard(Edge& edge, std::int64_t now_ms, Values& values);
  void look_for_silence(Edge& edge, std::int64_t now_ms, Values& values);
  static void die(Device& device, protocol::FedValue::Reason reason, Values& values);

  std::map<EdgeName, Edge> edges_;
  // Of all edge nodes together: after a start or a reconnection many are asked.
  sparkplug::RebirthBudget budget_{5.0, 20.0};
  Counts counts_;
};

// An NCMD's payload that asks for births.
std::string rebirth_request(std::uint64_t now_ms);

}  // namespace loopwarden::feed
