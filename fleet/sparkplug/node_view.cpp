// SPDX-License-Identifier: Apache-2.0
#include "fleet/sparkplug/node_view.hpp"

namespace loopwarden::sparkplug {
namespace {

constexpr Verdict kUsable{.usable = true};

Verdict missed(const char* why) { return {.usable = false, .ask_rebirth = true, .why = why}; }

std::optional<std::uint64_t> bd_seq_of(const Payload& payload) {
  const Metric* metric = payload.find("bdSeq");
  if (metric == nullptr) return std::nullopt;
  if (const auto* number = std::get_if<std::uint64_t>(&metric->value)) return *number;
  // Older clients send it as Int64.
  const auto* number = std::get_if<std::int64_t>(&metric->value);
  return number != nullptr && *number >= 0 ? std::optional(static_cast<std::uint64_t>(*number))
                                           : std::nullopt;
}

}  // namespace

void NodeView::go_offline() noexcept {
  online_ = false;
  devices_.clear();
}

Verdict NodeView::node_birth(const Payload& payload) {
  go_offline();
  const std::optional<std::uint64_t> bd_seq = bd_seq_of(payload);
  if (payload.seq != 0 || !bd_seq) return missed("an NBIRTH without seq 0 and bdSeq");
  aliases_.take_birth("", payload.metrics);
  bd_seq_ = bd_seq;
  online_ = true;
  expected_seq_ = 1;
  return kUsable;
}

Verdict NodeView::node_death(const Payload& payload) {
  const std::optional<std::uint64_t> bd_seq = bd_seq_of(payload);
  if (!bd_seq || bd_seq != bd_seq_) return {.why = "a death of another connection"};
  go_offline();
  return kUsable;
}

Verdict NodeView::of_online_node(const Topic& topic, Payload& payload) {
  switch (topic.type) {
    case MessageType::dbirth:
      devices_.erase(topic.device);
      aliases_.take_birth(topic.device, payload.metrics);
      devices_.insert(topic.device);
      return kUsable;
    case MessageType::ddeath:
      devices_.erase(topic.device);
      aliases_.remove(topic.device);
      return kUsable;
    case MessageType::ddata:
      if (!online(topic.device)) return missed("data of a device without a birth");
      [[fallthrough]];
    default: break;
  }
  if (!aliases_.resolve(topic.device, payload.metrics))
    return missed("a metric that no birth gave");
  return kUsable;
}

Verdict NodeView::in_sequence(const Topic& topic, Payload& payload) {
  if (!online_) return missed("no NBIRTH came before");
  if (!payload.seq || *payload.seq > 255) return missed("a message without seq");
  const bool gap = *payload.seq != expected_seq_;
  // Counted on from here, so that one gap is told once.
  expected_seq_ = static_cast<std::uint8_t>(*payload.seq + 1);
  Verdict verdict = of_online_node(topic, payload);
  if (gap && verdict.usable) {
    verdict.ask_rebirth = true;
    verdict.why = "a message is missing";
  }
  return verdict;
}

Verdict NodeView::take(const Topic& topic, Payload& payload) {
  switch (topic.type) {
    case MessageType::nbirth: return node_birth(payload);
    case MessageType::ndeath: return node_death(payload);
    case MessageType::ncmd:
    case MessageType::dcmd: return {.why = "a command"};
    default: return in_sequence(topic, payload);
  }
}

}  // namespace loopwarden::sparkplug
