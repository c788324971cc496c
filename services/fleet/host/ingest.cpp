// SPDX-License-Identifier: Apache-2.0
#include "services/fleet/host/ingest.hpp"

#include <algorithm>
#include <utility>

#include "services/net/sparkplug/payload.hpp"

namespace loopwarden::fleet {

using sparkplug::MessageType;

IngestCounts& IngestCounts::operator+=(const IngestCounts& other) noexcept {
  messages += other.messages;
  garbage += other.garbage;
  duplicates += other.duplicates;
  old_deaths += other.old_deaths;
  unborn += other.unborn;
  missing += other.missing;
  conflicts += other.conflicts;
  unknown_metrics += other.unknown_metrics;
  bad_times += other.bad_times;
  births += other.births;
  rebirths_asked += other.rebirths_asked;
  return *this;
}

class Ingest::Preparation {
 public:
  Preparation(Ingest& ingest, std::int64_t now_ms) : ingest_(ingest), now_ms_(now_ms) {}

  Batch run(const std::vector<Arrival>& arrivals) {
    for (const Arrival& arrival : arrivals) take(arrival);
    give_up_late();
    for (auto& [name, state] : batch_.edges) count_and_ask(name, state);
    return std::move(batch_);
  }

 private:
  EdgeState& touch(const EdgeName& name) {
    const auto known = batch_.edges.find(name);
    if (known != batch_.edges.end()) return known->second;
    const auto before = ingest_.edges_.find(name);
    if (before == ingest_.edges_.end()) ++new_edges_;
    EdgeState state = before != ingest_.edges_.end()
                          ? before->second
                          : EdgeState{.tracker = EdgeTracker(ingest_.tracker_settings_)};
    return batch_.edges.emplace(name, std::move(state)).first->second;
  }

  bool knows(const EdgeName& name) const {
    return batch_.edges.contains(name) || ingest_.edges_.contains(name);
  }

  void take(const Arrival& arrival) {
    ++batch_.counts.messages;
    std::optional<sparkplug::Topic> topic = sparkplug::parse_topic(arrival.topic);
    if (!topic || topic->type == MessageType::ncmd || topic->type == MessageType::dcmd) {
      if (!topic) ++batch_.counts.garbage;
      return;
    }
    Message message{.topic = std::move(*topic),
                    .received_ms = arrival.received_ms,
                    .left_over = arrival.left_over};
    try {
      message.payload = sparkplug::decode(arrival.payload);
    } catch (const sparkplug::BadPayload&) {
      ++batch_.counts.garbage;
      // An edge node's death is valid without a payload.
      if (message.topic.type != MessageType::ndeath) return;
    }
    const EdgeName name{message.topic.group, message.topic.edge};
    if (!knows(name) && ingest_.edges_.size() + new_edges_ >= ingest_.most_edges_) {
      ++batch_.counts.garbage;
      return;
    }
    EdgeState& state = touch(name);
    std::vector<Message> ready;
    count(state.tracker.take(std::move(message), now_ms_, ready));
    for (const Message& one : ready) apply(name, state, one);
  }

  void count(Verdict verdict) {
    switch (verdict) {
      case Verdict::duplicate: ++batch_.counts.duplicates; break;
      case Verdict::old_death: ++batch_.counts.old_deaths; break;
      case Verdict::unborn: ++batch_.counts.unborn; break;
      case Verdict::malformed: ++batch_.counts.garbage; break;
      default: break;
    }
  }

  void give_up_late() {
    std::vector<EdgeName> waiting;
    for (const auto& [name, state] : ingest_.edges_) {
      const bool may_ask = state.tracker.wants_rebirth() && state.rebirth.may_ask(now_ms_);
      if (state.tracker.waits() || may_ask) waiting.push_back(name);
    }
    for (const auto& [name, state] : batch_.edges) {
      if (state.tracker.waits()) waiting.push_back(name);
    }
    for (const EdgeName& name : waiting) {
      EdgeState& state = touch(name);
      std::vector<Message> ready;
      state.tracker.give_up_late(now_ms_, ready);
      for (const Message& one : ready) apply(name, state, one);
    }
  }

  void apply(const EdgeName& name, EdgeState& state, const Message& message) {
    const auto time_ms = static_cast<std::int64_t>(message.payload.time_ms.value_or(0));
    state.position = {.bd_seq = state.tracker.bd_seq().value_or(0),
                      .seq = state.tracker.newest_seq(),
                      .time_ms = time_ms > 0 ? time_ms : message.received_ms,
                      .received_ms = std::max(state.position.received_ms, message.received_ms)};
    switch (message.topic.type) {
      case MessageType::nbirth: return apply_node_birth(name, state, message);
      case MessageType::ndeath: return apply_node_death(name, state, message);
      case MessageType::dbirth: return apply_device_birth(name, state, message);
      case MessageType::ddeath: return apply_device_death(name, state, message);
      default: return apply_data(state, message);
    }
  }

  void happened(const EdgeName& name, const EdgeState& state, const Message& message,
                const BookPointer& book, bool online) {
    if (overtaken(state, message)) return;
    batch_.events.push_back({.edge = name,
                             .book = book,
                             .of_node = message.topic.device.empty(),
                             .online = online,
                             .received_ms = message.received_ms,
                             .born_ms = online ? state.position.time_ms : 0});
  }

  // Returns whether another host has continued since the spool was written. Its messages are then
  // never the newest.
  static bool overtaken(const EdgeState& state, const Message& message) {
    return message.left_over && message.received_ms < state.stored_received_ms;
  }

  BookPointer new_book(const EdgeName& name, const Message& message) {
    BookPointer book = book_of(message.topic.device, message.payload.metrics);
    batch_.books.emplace_back(name, book);
    return book;
  }

  void apply_node_birth(const EdgeName& name, EdgeState& state, const Message& message) {
    ++batch_.counts.births;
    state.rebirth.born(now_ms_);
    const BookPointer book = new_book(name, message);
    if (state.unread_bd_seq != state.tracker.bd_seq()) drop_unread(state);
    state.books = {{"", book}};
    happened(name, state, message, book, true);
    apply_rows(state, message, book);
  }

  void apply_node_death(const EdgeName& name, EdgeState& state, const Message& message) {
    state.books.clear();
    drop_unread(state);
    happened(name, state, message, nullptr, false);
  }

  void apply_device_birth(const EdgeName& name, EdgeState& state, const Message& message) {
    const BookPointer book = new_book(name, message);
    state.books[message.topic.device] = book;
    read_unread(state, book);
    happened(name, state, message, book, true);
    apply_rows(state, message, book);
  }

  // Reads stored data after the device's birth has arrived. An edge node gives its metrics the same
  // aliases in each birth of a connection.
  void read_unread(EdgeState& state, const BookPointer& book) {
    std::vector<Message> others;
    for (Message& message : std::exchange(state.unread, {})) {
      if (message.topic.device == book->device) {
        apply_rows(state, message, book);
      } else {
        others.push_back(std::move(message));
      }
    }
    state.unread = std::move(others);
  }

  void drop_unread(EdgeState& state) {
    batch_.counts.unborn += state.unread.size();
    state.unread.clear();
  }

  void apply_device_death(const EdgeName& name, EdgeState& state, const Message& message) {
    const auto found = state.books.find(message.topic.device);
    if (found == state.books.end()) return;
    happened(name, state, message, found->second, false);
    state.books.erase(found);
  }

  void apply_data(EdgeState& state, const Message& message) {
    const auto found = state.books.find(message.topic.device);
    if (found != state.books.end()) return apply_rows(state, message, found->second);
    state.tracker.want_rebirth();
    if (state.unread.size() < kMostUnread) {
      state.unread_bd_seq = state.tracker.bd_seq();
      state.unread.push_back(message);
    } else {
      ++batch_.counts.unborn;
    }
  }

  void apply_rows(EdgeState& state, const Message& message, const BookPointer& book) {
    const std::size_t first = batch_.rows.values.size();
    const ReduceOutcome outcome = reduce(message, book, batch_.rows);
    batch_.counts.unknown_metrics += outcome.unknown_metrics;
    batch_.counts.bad_times += outcome.bad_times;
    if (outcome.unknown_metrics > 0) state.tracker.want_rebirth();
    const bool old = overtaken(state, message);
    for (std::size_t i = first; old && i < batch_.rows.values.size(); ++i) {
      batch_.rows.values[i].historical = true;
    }
    if (message.payload.time_ms) {
      batch_.times_ms.push_back(static_cast<std::int64_t>(*message.payload.time_ms));
    }
  }

  void count_and_ask(const EdgeName& name, EdgeState& state) {
    const auto before = ingest_.edges_.find(name);
    const bool known = before != ingest_.edges_.end();
    const EdgeTracker* old = known ? &before->second.tracker : nullptr;
    const std::uint64_t conflicts = state.tracker.conflicts() - (known ? old->conflicts() : 0);
    batch_.counts.missing += state.tracker.missing() - (known ? old->missing() : 0);
    batch_.counts.conflicts += conflicts;
    if (conflicts > 0) batch_.conflicts.push_back(name);
    if (!state.tracker.wants_rebirth() || !state.rebirth.may_ask(now_ms_)) return;
    if (!ingest_.budget_.take(now_ms_)) return;
    state.rebirth.asked(now_ms_);
    ++batch_.counts.rebirths_asked;
    batch_.ask_rebirth.push_back(name);
  }

  Ingest& ingest_;
  std::int64_t now_ms_;
  std::size_t new_edges_ = 0;
  Batch batch_;
};

Batch Ingest::prepare(const std::vector<Arrival>& arrivals, std::int64_t now_ms) {
  return Preparation(*this, now_ms).run(arrivals);
}

void Ingest::know(const EdgeName& name, int id, const Position& position,
                  std::map<std::string, BookPointer> books) {
  EdgeState state{.tracker = EdgeTracker(tracker_settings_)};
  state.id = id;
  state.stored_received_ms = position.received_ms;
  if (!books.empty()) {
    state.tracker.resume(position.bd_seq, position.seq);
    state.position = position;
    state.books = std::move(books);
  }
  edges_.insert_or_assign(name, std::move(state));
}

void Ingest::forget_births() {
  for (auto& [name, state] : edges_) {
    state.tracker.forget();
    state.books.clear();
  }
}

void Ingest::commit(Batch batch) {
  for (auto& [name, state] : batch.edges) edges_.insert_or_assign(name, std::move(state));
  counts_ += batch.counts;
}

}  // namespace loopwarden::fleet
