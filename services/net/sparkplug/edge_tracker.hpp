// SPDX-License-Identifier: Apache-2.0
// Restores the order of one edge node's messages: births, deaths, missing messages and duplicates.
// It uses no I/O and no clock.
//
// MQTT keeps the order within a connection. Brokers in a cluster may change it, and messages of QoS
// 0 may be lost. A message after a gap therefore waits in a window for the missing ones. After the
// reorder timeout, or when the window is full, the gap is given up. The waiting messages are then
// passed on in order, and a rebirth is requested.
//
// A death names the bdSeq of its birth, by its name or by the alias from the birth. A death with
// another bdSeq belongs to an older connection. A death without a readable bdSeq ends the
// connection in force, because its own connection is unknown.
//
// Limit: two edge nodes of one name look like one that restarts often. Only conflicts reveal them:
// two messages with one sequence number and different times.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "services/net/sparkplug/payload.hpp"
#include "services/net/sparkplug/topic.hpp"

namespace loopwarden::sparkplug {

struct Message {
  Topic topic;
  Payload payload{};
  std::int64_t received_ms = 0;  // since 1970, UTC, by the host's clock
  bool left_over = false;        // received by an earlier run of the host
};

enum class Verdict : std::uint8_t {
  taken,            // in order: passed on, followed by the messages that waited for it
  held,             // after a gap: it waits
  late,             // belongs to a gap that was given up: passed on
  duplicate,        // same bdSeq, seq and time as an earlier message: dropped
  old_death,        // belongs to a connection that a newer one has replaced: dropped
  unborn,           // no birth was received: dropped, and a rebirth is requested
  unmatched_death,  // its bdSeq is unreadable: it counts, and a rebirth is requested
  malformed         // a required seq or bdSeq is missing: dropped
};

struct TrackerSettings {
  std::size_t window = 16;                 // waiting messages, at most 100
  std::int64_t reorder_timeout_ms = 2000;  // since the first waiting message
};

class EdgeTracker {
 public:
  explicit EdgeTracker(TrackerSettings settings = {}) : settings_(settings) {}

  // Takes a message. Appends the messages that can be passed on now to `ready`, in order.
  Verdict take(Message message, std::int64_t now_ms, std::vector<Message>& ready);
  // Restores a stored state: born with that bdSeq, `seq` is that of the newest message.
  void resume(std::uint8_t bd_seq, std::uint8_t seq) noexcept;
  // Forgets births and order.
  void forget() noexcept;
  // Gives up the gap if it is older than the timeout. Returns true if it did.
  bool give_up_late(std::int64_t now_ms, std::vector<Message>& ready);

  bool born() const noexcept { return born_; }
  bool waits() const noexcept { return !held_.empty(); }
  // A birth must be requested. True until the next NBIRTH.
  bool wants_rebirth() const noexcept { return wants_rebirth_; }
  // Requests a rebirth for a reason outside the tracker: an alias or a device that no birth
  // contained.
  void want_rebirth() noexcept { wants_rebirth_ = true; }

  std::optional<std::uint8_t> bd_seq() const noexcept { return bd_seq_; }
  std::uint8_t newest_seq() const noexcept { return static_cast<std::uint8_t>(next_ - 1); }
  // messages in gaps that were given up, since the start
  std::uint64_t missing() const noexcept { return missing_; }
  std::uint64_t conflicts() const noexcept { return conflicts_; }  // since the start

 private:
  Verdict take_birth(Message message, std::vector<Message>& ready);
  Verdict take_death(Message message, std::vector<Message>& ready);
  Verdict take_data(Message message, std::int64_t now_ms, std::vector<Message>& ready);
  Verdict hold(std::uint8_t distance, Message message, std::int64_t now_ms,
               std::vector<Message>& ready);
  void accept(Message message, std::vector<Message>& ready);
  void release_in_order(std::vector<Message>& ready);
  void give_up(std::vector<Message>& ready);

  TrackerSettings settings_;
  bool born_ = false;
  bool wants_rebirth_ = false;
  std::optional<std::uint8_t> bd_seq_;
  std::optional<std::uint64_t> bd_seq_alias_;  // from the newest birth
  std::uint8_t next_ = 0;
  std::array<std::uint64_t, 256>
      times_{};  // of the newest message with each seq; 0: none since the birth
  std::map<std::uint8_t, Message> held_;  // by distance from `next_`
  std::int64_t gap_since_ms_ = 0;
  std::uint64_t missing_ = 0;
  std::uint64_t conflicts_ = 0;
};

}  // namespace loopwarden::sparkplug
