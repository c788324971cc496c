// SPDX-License-Identifier: Apache-2.0
// Reads the messages of foreign Sparkplug B edge nodes and makes values for feed.sock from the
// metrics that rules name. Pure: the caller passes the time.
//
// A value is valid from the birth that names its metric until a death. Data before the birth and
// historical values are left out. If messages are missing, their content is unknown: all values of
// that edge node are uncertain until it sends them again. A device that an NBIRTH does not bring
// back within kDeviceWaitMs is dead.
//
// A malformed death or birth ends the values of everything it may refer to, and a birth is
// requested. A silent edge node is asked for a birth after half the timeout of its metrics. After
// the whole timeout its values are bad until its next message. Then they are valid again, unless
// messages are missing.
//
// Limit: data of an edge node that was born before this connection can't be read until its next
// birth.
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
    std::uint64_t dropped = 0;  // without a birth, repeated, or of an older connection
    std::uint64_t historical = 0;  // values
    std::uint64_t missing = 0;     // messages
    std::uint64_t deaths = 0;
    std::uint64_t timeouts = 0;  // of values
  };
  using EdgeName = std::pair<std::string, std::string>;  // group, edge

  explicit ForeignEdges(const std::vector<MetricRule>& rules);

  // Appends the values that are now valid. Faults of the message are written to `complaint`.
  void take(const sparkplug::Topic& topic, std::string_view payload, std::int64_t now_ms,
            std::vector<protocol::FedValue>& values, std::string& complaint);
  // Appends the values whose timeout has passed.
  void look(std::int64_t now_ms, std::vector<protocol::FedValue>& values);
  // The broker is there: edge nodes and devices without a birth are dead after kDeviceWaitMs.
  void connected(std::int64_t now_ms);
  // The broker is away: births must arrive again. Appends bad values for all known values.
  void disconnected(std::vector<protocol::FedValue>& values);

  // Returns the edge nodes whose birth is missing and may be requested now. They count as asked.
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
    std::optional<std::int64_t> awaited_since_ms{};  // its node was born, this device was not yet
    std::map<std::string, std::vector<Metric>>
        metrics;  // by their name; a value may have several names
    std::unordered_map<std::uint64_t, std::vector<Metric>*> by_alias;
  };
  struct Edge {
    std::string name{};  // for people
    sparkplug::EdgeTracker tracker{};
    sparkplug::RebirthWait rebirth{};
    std::uint64_t missing = 0;              // as many as the values already reflect
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
  // Handles a malformed message.
  static void refuse(Edge& edge, const sparkplug::Topic& topic, Values& values);
  static void heard(Edge& edge, std::int64_t now_ms, Values& values);
  void look_for_silence(Edge& edge, std::int64_t now_ms, Values& values);
  static void blame(Values& values, std::size_t first, std::string_view source);
  static void die(Device& device, protocol::FedValue::Reason reason, Values& values);

  std::map<EdgeName, Edge> edges_;
  // Shared by all edge nodes: after a start or a reconnection many are asked.
  sparkplug::RebirthBudget budget_{5.0, 20.0};
  Counts counts_;
};

// Returns the payload of an NCMD that asks for births.
std::string rebirth_request(std::uint64_t now_ms);

}  // namespace loopwarden::feed
