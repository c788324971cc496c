// SPDX-License-Identifier: Apache-2.0
#include "services/feed/values/foreign_edges.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "base/text.hpp"

#include "services/feed/values/quality_code.hpp"

namespace loopwarden::feed {

using protocol::FedValue;
using sparkplug::DataType;
using sparkplug::MessageType;
using sparkplug::Verdict;
using Quality = FedValue::Quality;

namespace {

// Returns why the tracker finds a message malformed.
std::string refusal_of(const sparkplug::Message& message) {
  const sparkplug::Payload& payload = message.payload;
  if (!payload.seq) return "it has no seq";
  if (message.topic.type != MessageType::nbirth) return "its seq is not from 0 to 255";
  if (*payload.seq != 0) {
    return "its seq is " + std::to_string(*payload.seq) + ", a birth of an edge node has seq 0";
  }
  return payload.find("bdSeq") == nullptr ? "it has no metric bdSeq"
                                          : "its bdSeq is not a whole number from 0 to 255";
}

}  // namespace

ForeignEdges::ForeignEdges(const std::vector<MetricRule>& rules) {
  for (const MetricRule& rule : rules) {
    Edge& edge = edges_[{rule.group, rule.edge}];
    edge.name = fmt::format("edge node {}/{}", rule.group, rule.edge);
    Metric metric;
    metric.newest.name = rule.name;
    metric.timeout_ms = rule.timeout_ms;
    edge.devices[rule.device].metrics[rule.metric].push_back(std::move(metric));
    edge.tracker.want_rebirth();
  }
}

void ForeignEdges::take(const sparkplug::Topic& topic, std::string_view payload,
                        std::int64_t now_ms, Values& values, std::string& complaint) {
  const auto found = edges_.find({topic.group, topic.edge});
  if (found == edges_.end()) {
    ++counts_.unknown;
    return;
  }
  Edge& edge = found->second;
  sparkplug::Message message{.topic = topic, .received_ms = now_ms};
  try {
    message.payload = sparkplug::decode(payload);
  } catch (const sparkplug::BadPayload& e) {
    ++counts_.bad_payloads;
    complaint = to_text(topic) + ": " + e.what();
    // A node's death needs no content: topic and broker are enough.
    if (topic.type != MessageType::ndeath) return refuse(edge, topic, values);
  }
  std::vector<sparkplug::Message> ready;
  const std::string refusal = refusal_of(message);  // if it is refused
  const Verdict verdict = edge.tracker.take(std::move(message), now_ms, ready);
  if (topic.type != MessageType::ndeath) heard(edge, now_ms, values);
  switch (verdict) {
    case Verdict::malformed:
      ++counts_.bad_payloads;
      complaint = to_text(topic) + ": refused, " + refusal;
      refuse(edge, topic, values);
      break;
    case Verdict::unmatched_death:
      if (!complaint.empty()) complaint += "; ";
      complaint += to_text(topic) +
                   ": bdSeq can't be read, so the ended connection is unknown. All values of "
                   "the edge node are bad until it is born again";
      break;
    case Verdict::duplicate:
    case Verdict::old_death:
    case Verdict::unborn: ++counts_.dropped; break;
    default: break;
  }
  doubt_after_gap(edge, values);
  for (const sparkplug::Message& one : ready) apply(edge, one, now_ms, values, complaint);
}

// Names the lost part in the bad values from index `first` on.
void ForeignEdges::blame(Values& values, std::size_t first, std::string_view source) {
  for (std::size_t i = first; i < values.size(); ++i) {
    if (values[i].quality == Quality::bad) {
      values[i].source = source.substr(0, FedValue::kLongestSource);
    }
  }
}

void ForeignEdges::apply(Edge& edge, const sparkplug::Message& message, std::int64_t now_ms,
                         Values& values, std::string& complaint) {
  const MessageType type = message.topic.type;
  if (type == MessageType::nbirth) node_born(edge, now_ms);
  if (type == MessageType::ndeath) {
    ++counts_.deaths;
    const std::size_t first = values.size();
    for (auto& [name, device] : edge.devices) die(device, FedValue::Reason::death, values);
    return blame(values, first, edge.name);
  }
  const auto found = edge.devices.find(message.topic.device);
  if (found == edge.devices.end()) {
    // The metrics of the node itself arrive whether a rule names them or not.
    if (!message.topic.device.empty()) ++counts_.unknown;
    return;
  }
  switch (type) {
    case MessageType::nbirth:
    case MessageType::dbirth: return born(found->second, message, values, complaint);
    case MessageType::ddeath: {
      ++counts_.deaths;
      const std::size_t first = values.size();
      die(found->second, FedValue::Reason::death, values);
      return blame(values, first, fmt::format("{}, device {}", edge.name, found->first));
    }
    default: return data(edge, found->second, message, values, complaint);
  }
}

void ForeignEdges::refuse(Edge& edge, const sparkplug::Topic& topic, Values& values) {
  const bool node = topic.type == MessageType::nbirth || topic.type == MessageType::ndeath;
  const bool device = topic.type == MessageType::dbirth || topic.type == MessageType::ddeath;
  const auto reason =
      topic.type == MessageType::ddeath ? FedValue::Reason::death : FedValue::Reason::source;
  for (auto& [name, one] : edge.devices) {
    if (node || (device && name == topic.device)) die(one, reason, values);
    // Data that can't be read may have held newer values.
    if (!node && !device && name == topic.device) doubt(one, values);
  }
  edge.tracker.want_rebirth();
}

void ForeignEdges::heard(Edge& edge, std::int64_t now_ms, Values& values) {
  edge.heard_ms = now_ms;
  for (auto& [name, device] : edge.devices) {
    for (auto& [metric_name, metrics] : device.metrics) {
      for (Metric& metric : metrics) {
        if (std::exchange(metric.silent, false)) values.push_back(metric.newest);
      }
    }
  }
}

void ForeignEdges::look_for_silence(Edge& edge, std::int64_t now_ms, Values& values) {
  const std::int64_t silent_ms = now_ms - edge.heard_ms;
  for (auto& [name, device] : edge.devices) {
    if (!device.born) continue;
    for (auto& [metric_name, metrics] : device.metrics) {
      for (Metric& metric : metrics) {
        if (metric.timeout_ms == 0 || metric.silent) continue;
        if (silent_ms > metric.timeout_ms / 2) edge.tracker.want_rebirth();
        if (silent_ms <= metric.timeout_ms) continue;
        metric.silent = true;
        ++counts_.timeouts;
        values.push_back({.name = metric.newest.name,
                          .quality = Quality::bad,
                          .reason = FedValue::Reason::timeout});
      }
    }
  }
}

void ForeignEdges::node_born(Edge& edge, std::int64_t now_ms) {
  edge.rebirth.born(now_ms);
  for (auto& [name, device] : edge.devices) {
    device.born = false;
    device.by_alias.clear();
    if (!name.empty()) device.awaited_since_ms = now_ms;
  }
}

void ForeignEdges::born(Device& device, const sparkplug::Message& message, Values& values,
                        std::string& complaint) {
  device.born = true;
  device.awaited_since_ms.reset();
  device.by_alias.clear();
  for (auto& [name, metrics] : device.metrics) {
    const sparkplug::Metric* said = message.payload.find(name);
    if (said == nullptr) {
      complaint = to_text(message.topic) + ": no metric '" + name + "'";
      for (Metric& metric : metrics) {
        metric.newest = {.name = metric.newest.name, .quality = Quality::bad};
        values.push_back(metric.newest);
      }
      continue;
    }
    if (said->alias) device.by_alias.insert_or_assign(*said->alias, &metrics);
    for (Metric& metric : metrics) metric.type = said->type;
    say(metrics, *said, message.payload, values, complaint);
  }
}

void ForeignEdges::data(Edge& edge, Device& device, const sparkplug::Message& message,
                        Values& values, std::string& complaint) {
  if (!device.born) {
    ++counts_.dropped;
    edge.tracker.want_rebirth();
    return;
  }
  for (const sparkplug::Metric& said : message.payload.metrics) {
    std::vector<Metric>* metrics = nullptr;
    if (!said.name.empty()) {
      const auto found = device.metrics.find(said.name);
      if (found != device.metrics.end()) metrics = &found->second;
    } else if (said.alias) {
      const auto found = device.by_alias.find(*said.alias);
      if (found != device.by_alias.end()) metrics = found->second;
    }
    if (metrics != nullptr) say(*metrics, said, message.payload, values, complaint);
  }
}

void ForeignEdges::say(std::vector<Metric>& metrics, const sparkplug::Metric& said,
                       const sparkplug::Payload& payload, Values& values, std::string& complaint) {
  if (said.historical) {
    ++counts_.historical;
    return;
  }
  const std::optional<std::uint64_t> time_ms = said.time_ms ? said.time_ms : payload.time_ms;
  const sparkplug::Property* quality = said.property("Quality");
  const std::optional<double> code =
      quality == nullptr ? std::nullopt : sparkplug::number_of(quality->value);
  for (Metric& metric : metrics) {
    const sparkplug::Value value =
        metric.type == DataType::unknown ? said.value : sparkplug::retyped(said.value, metric.type);
    FedValue fed{.name = metric.newest.name, .value = sparkplug::number_of(value)};
    if (time_ms) fed.time_s = static_cast<double>(*time_ms) * 1e-3;
    if (code) fed.quality = quality_of_code(*code, QualityCodes::opc);
    const auto* text = std::get_if<std::string>(&value);
    const bool word = text != nullptr && !text->empty() && text->size() <= FedValue::kLongestWord &&
                      base::is_utf8(*text);
    if (word) fed.word = *text;
    if (!fed.value && !word) {
      fed.quality = Quality::bad;
      const bool number =
          std::holds_alternative<std::monostate>(value) || std::holds_alternative<double>(value);
      if (!number) {
        ++counts_.bad_payloads;
        complaint = "a value for " + fed.name + " is no number and no word";
      }
    }
    metric.newest = fed;
    values.push_back(std::move(fed));
  }
}

void ForeignEdges::doubt_after_gap(Edge& edge, Values& values) {
  if (edge.tracker.missing() == edge.missing) return;
  edge.missing = edge.tracker.missing();
  for (auto& [name, device] : edge.devices) doubt(device, values);
}

void ForeignEdges::doubt(Device& device, Values& values) {
  if (!device.born) return;
  for (auto& [name, metrics] : device.metrics) {
    for (Metric& metric : metrics) {
      if (metric.newest.quality != Quality::good) continue;
      metric.newest.quality = Quality::uncertain;
      values.push_back(metric.newest);
    }
  }
}

void ForeignEdges::die(Device& device, FedValue::Reason reason, Values& values) {
  device.born = false;
  device.awaited_since_ms.reset();
  device.by_alias.clear();
  for (auto& [name, metrics] : device.metrics) {
    for (Metric& metric : metrics) {
      metric.newest = {.name = metric.newest.name, .quality = Quality::bad, .reason = reason};
      metric.silent = false;
      values.push_back(metric.newest);
    }
  }
}

void ForeignEdges::look(std::int64_t now_ms, Values& values) {
  std::string unsaid;
  for (auto& [name, edge] : edges_) {
    std::vector<sparkplug::Message> ready;
    const std::size_t first = values.size();
    if (edge.tracker.give_up_late(now_ms, ready)) {
      doubt_after_gap(edge, values);
      for (const sparkplug::Message& one : ready) apply(edge, one, now_ms, values, unsaid);
    }
    for (auto& [device_name, device] : edge.devices) {
      const bool late =
          device.awaited_since_ms && now_ms - *device.awaited_since_ms > kDeviceWaitMs;
      if (late) die(device, FedValue::Reason::death, values);
    }
    look_for_silence(edge, now_ms, values);
    blame(values, first, edge.name);
  }
}

void ForeignEdges::connected(std::int64_t now_ms) {
  for (auto& [name, edge] : edges_) {
    for (auto& [device_name, device] : edge.devices) {
      if (!device.born) device.awaited_since_ms = now_ms;
    }
  }
}

void ForeignEdges::disconnected(Values& values) {
  for (auto& [name, edge] : edges_) {
    edge.tracker.forget();
    edge.tracker.want_rebirth();
    edge.rebirth = {};
    for (auto& [device_name, device] : edge.devices) die(device, FedValue::Reason::link, values);
  }
}

std::vector<ForeignEdges::EdgeName> ForeignEdges::to_ask(std::int64_t now_ms) {
  std::vector<EdgeName> asked;
  for (auto& [name, edge] : edges_) {
    if (!edge.tracker.wants_rebirth() || !edge.rebirth.may_ask(now_ms)) continue;
    if (!budget_.take(now_ms)) break;
    edge.rebirth.asked(now_ms);
    asked.push_back(name);
  }
  return asked;
}

std::vector<ForeignEdges::EdgeName> ForeignEdges::edges() const {
  std::vector<EdgeName> names;
  for (const auto& [name, edge] : edges_) names.push_back(name);
  return names;
}

bool ForeignEdges::all_born() const noexcept {
  return std::all_of(edges_.begin(), edges_.end(),
                     [](const auto& edge) { return edge.second.tracker.born(); });
}

ForeignEdges::Counts ForeignEdges::counts() const noexcept {
  Counts counts = counts_;
  for (const auto& [name, edge] : edges_) counts.missing += edge.tracker.missing();
  return counts;
}

std::string rebirth_request(std::uint64_t now_ms) {
  sparkplug::Metric metric;
  metric.name = "Node Control/Rebirth";
  metric.time_ms = now_ms;
  metric.type = DataType::boolean;
  metric.value = true;
  return sparkplug::encode({.time_ms = now_ms, .seq = {}, .metrics = {std::move(metric)}},
                           sparkplug::Types::sent);
}

}  // namespace loopwarden::feed
