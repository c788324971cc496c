// SPDX-License-Identifier: Apache-2.0
#include "services/net/sparkplug/edge_tracker.hpp"

#include <utility>

namespace loopwarden::sparkplug {
namespace {

// bdSeq and seq count from 0 to 255. Older clients send bdSeq as a signed number.
std::optional<std::uint8_t> counter_of(const Value& value) {
  std::uint64_t number = 256;
  if (const auto* unsigned_one = std::get_if<std::uint64_t>(&value)) number = *unsigned_one;
  if (const auto* signed_one = std::get_if<std::int64_t>(&value)) {
    number = static_cast<std::uint64_t>(*signed_one);
  }
  return number < 256 ? std::optional(static_cast<std::uint8_t>(number)) : std::nullopt;
}

// Returns bdSeq. `alias`: alias of bdSeq in the previous birth; a metric may have it instead of the
// name.
std::optional<std::uint8_t> bd_seq_of(const Payload& payload, std::optional<std::uint64_t> alias) {
  const Metric* metric = payload.find("bdSeq");
  for (const Metric& one : payload.metrics) {
    if (metric == nullptr && alias && one.name.empty() && one.alias == alias) metric = &one;
  }
  return metric == nullptr ? std::nullopt : counter_of(metric->value);
}

std::optional<std::uint8_t> seq_of(const Payload& payload) {
  return payload.seq ? counter_of(*payload.seq) : std::nullopt;
}

std::uint64_t time_of(const Message& message) { return message.payload.time_ms.value_or(0); }

}  // namespace

Verdict EdgeTracker::take(Message message, std::int64_t now_ms, std::vector<Message>& ready) {
  switch (message.topic.type) {
    case MessageType::nbirth: return take_birth(std::move(message), ready);
    case MessageType::ndeath: return take_death(std::move(message), ready);
    default: return take_data(std::move(message), now_ms, ready);
  }
}

Verdict EdgeTracker::take_birth(Message message, std::vector<Message>& ready) {
  const std::optional<std::uint8_t> bd_seq = bd_seq_of(message.payload, std::nullopt);
  const std::optional<std::uint8_t> seq = seq_of(message.payload);
  if (!bd_seq || seq != std::uint8_t{0}) {
    wants_rebirth_ = true;
    return Verdict::malformed;
  }
  const std::uint64_t time = time_of(message);
  if (born_ && bd_seq == bd_seq_ && time != 0 && times_[0] == time && next_ != 0) {
    return Verdict::duplicate;
  }
  // Held messages are older than this birth.
  give_up(ready);
  times_.fill(0);
  born_ = true;
  wants_rebirth_ = false;
  bd_seq_ = bd_seq;
  bd_seq_alias_ = message.payload.find("bdSeq")->alias;
  next_ = 0;
  accept(std::move(message), ready);
  return Verdict::taken;
}

Verdict EdgeTracker::take_death(Message message, std::vector<Message>& ready) {
  const std::optional<std::uint8_t> bd_seq = bd_seq_of(message.payload, bd_seq_alias_);
  if (bd_seq && bd_seq_ && bd_seq != bd_seq_) return Verdict::old_death;
  if (bd_seq_ && !born_) return Verdict::duplicate;
  give_up(ready);
  born_ = false;
  // After a death, the next message is a birth, so no rebirth is requested. A death of an older
  // connection is the exception: the edge node is alive and answers a request.
  wants_rebirth_ = !bd_seq;
  if (bd_seq) bd_seq_ = bd_seq;
  ready.push_back(std::move(message));
  return bd_seq ? Verdict::taken : Verdict::unmatched_death;
}

Verdict EdgeTracker::take_data(Message message, std::int64_t now_ms, std::vector<Message>& ready) {
  const std::optional<std::uint8_t> seq = seq_of(message.payload);
  if (!seq) return Verdict::malformed;
  if (!born_) {
    wants_rebirth_ = true;
    return Verdict::unborn;
  }
  const auto distance = static_cast<std::uint8_t>(*seq - next_);
  if (distance == 0) {
    accept(std::move(message), ready);
    release_in_order(ready);
    return Verdict::taken;
  }
  const std::uint64_t time = time_of(message);
  if (time != 0 && times_[*seq] == time) return Verdict::duplicate;
  // A number up to `window` ahead waits. A number from 128 ahead on counts as an earlier, late one.
  if (distance <= settings_.window) return hold(distance, std::move(message), now_ms, ready);
  if (distance >= 128) {
    if (times_[*seq] != 0) ++conflicts_;
    times_[*seq] = time;
    ready.push_back(std::move(message));
    return Verdict::late;
  }
  // Too many messages are missing to wait for them.
  give_up(ready);
  missing_ += static_cast<std::uint8_t>(*seq - next_);
  wants_rebirth_ = true;
  next_ = *seq;
  accept(std::move(message), ready);
  return Verdict::taken;
}

Verdict EdgeTracker::hold(std::uint8_t distance, Message message, std::int64_t now_ms,
                          std::vector<Message>& ready) {
  if (held_.empty()) gap_since_ms_ = now_ms;
  const auto [place, is_new] = held_.try_emplace(distance, std::move(message));
  if (!is_new) {
    if (time_of(place->second) == time_of(message)) return Verdict::duplicate;
    ++conflicts_;
    // Both messages are passed on. The order of two messages with the same number is unknown.
    ready.push_back(std::move(message));
    return Verdict::late;
  }
  if (held_.size() >= settings_.window) give_up(ready);
  return Verdict::held;
}

void EdgeTracker::resume(std::uint8_t bd_seq, std::uint8_t seq) noexcept {
  born_ = true;
  bd_seq_ = bd_seq;
  next_ = static_cast<std::uint8_t>(seq + 1);
}

void EdgeTracker::forget() noexcept {
  born_ = false;
  wants_rebirth_ = false;
  bd_seq_.reset();
  bd_seq_alias_.reset();
  held_.clear();
}

bool EdgeTracker::give_up_late(std::int64_t now_ms, std::vector<Message>& ready) {
  if (held_.empty()) return false;
  const std::int64_t waited = now_ms - gap_since_ms_;
  // A clock that was set back must not extend the wait without limit.
  if (waited >= 0 && waited < settings_.reorder_timeout_ms) return false;
  give_up(ready);
  return true;
}

void EdgeTracker::accept(Message message, std::vector<Message>& ready) {
  times_[next_] = time_of(message);
  ++next_;
  ready.push_back(std::move(message));
}

void EdgeTracker::release_in_order(std::vector<Message>& ready) {
  std::map<std::uint8_t, Message> waiting = std::exchange(held_, {});
  const std::uint8_t base = static_cast<std::uint8_t>(next_ - 1);
  for (auto& [distance, message] : waiting) {
    const auto seq = static_cast<std::uint8_t>(base + distance);
    if (seq == next_) {
      accept(std::move(message), ready);
    } else {
      held_.emplace(static_cast<std::uint8_t>(seq - next_), std::move(message));
    }
  }
}

void EdgeTracker::give_up(std::vector<Message>& ready) {
  if (held_.empty()) return;
  const std::uint8_t base = next_;
  for (auto& [distance, message] : std::exchange(held_, {})) {
    const auto seq = static_cast<std::uint8_t>(base + distance);
    missing_ += static_cast<std::uint8_t>(seq - next_);
    next_ = seq;
    accept(std::move(message), ready);
  }
  wants_rebirth_ = true;
}

}  // namespace loopwarden::sparkplug
