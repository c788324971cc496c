// SPDX-License-Identifier: Apache-2.0
// The order of one edge node's messages: births and deaths, what is missing, what came twice. No
// I/O, no clock.
//
// MQTT keeps the order of a connection, yet brokers in a cluster may not, and messages of QoS 0 may
// be lost. So a message from beyond a gap waits in a window for those before it; after the reorder
// timeout, or where the window is full, the gap is given up: what waited goes on in order, and a
// rebirth is wanted.
//
// A death names the bdSeq of its birth, by its name or by the alias of the birth. One with another
// bdSeq is of an older connection. Nobody knows what a death without a readable bdSeq ends, so it
// ends the connection in force.
//
// It can't tell two edge nodes of one name from one that restarts often, except by conflicts: two
// messages of one sequence number with different times.
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
  taken,            // in order; it is among what is passed on, with what had waited for it
  held,             // beyond a gap: it waits
  late,             // of a gap that was given up; passed on
  duplicate,        // the same bdSeq, seq and time once more: dropped
  old_death,        // of a connection that a newer one has replaced: dropped
  unborn,           // no birth is known: dropped, a rebirth is wanted
  unmatched_death,  // its bdSeq can't be read: it counts, and a rebirth is wanted
  malformed         // no seq, or no bdSeq, where there must be one: dropped
};

struct TrackerSettings {
  std::size_t window = 16;                 // messages that wait, at most 100
  std::int64_t reorder_timeout_ms = 2000;  // from the first that waits
};

class EdgeTracker {
 public:
  explicit EdgeTracker(TrackerSettings settings = {}) : settings_(settings) {}

  // What can go on now is appended to `ready`, in order.
  Verdict take(Message message, std::int64_t now_ms, std::vector<Message>& ready);
  // As a host left it: born with that bdSeq, and that seq was the newest.
  void resume(std::uint8_t bd_seq, std::uint8_t seq) noexcept;
  // Whatever was known of births and order no longer counts.
  void forget() noexcept;
  // Gives up the gap if it is older than the timeout. True if it did.
  bool give_up_late(std::int64_t now_ms, std::vector<Message>& ready);

  bool born() const noexcept { return born_; }
  bool waits() const noexcept { return !held_.empty(); }
  // A birth must be asked for. True until the next NBIRTH.
  bool wants_rebirth() const noexcept { return wants_rebirth_; }
  // For what the tracker can't see: an alias or a device that no birth gave.
  void want_rebirth() noexcept { wants_rebirth_ = true; }

  std::optional<std::uint8_t> bd_seq() const noexcept { return bd_seq_; }
  std::uint8_t newest_seq() const noexcept { return static_cast<std::uint8_t>(next_ - 1); }
  std::uint64_t missing() const noexcept { return missing_; }  // messages given up, since the start
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
  std::optional<std::uint64_t> bd_seq_alias_;  // of the newest birth
  std::uint8_t next_ = 0;
  std::array<std::uint64_t, 256>
      times_{};  // of the newest message of each seq; 0: none since the birth
  std::map<std::uint8_t, Message> held_;  // by how far they are beyond `next_`
  std::int64_t gap_since_ms_ = 0;
  std::uint64_t missing_ = 0;
  std::uint64_t conflicts_ = 0;
};

}  // namespace loopwarden::sparkplug
