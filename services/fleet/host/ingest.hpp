// SPDX-License-Identifier: Apache-2.0
// From what the broker delivers to what the database is to hold, for the edge nodes of one group. No I/O, no clock.
//
//   Batch batch = ingest.prepare(arrivals, now)   on copies of the edges' states
//   ... written to the database in one transaction ...
//   ingest.commit(batch)                          only now it has happened
//
// A batch that could not be written is thrown away and prepared again later, with the same outcome.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "services/fleet/host/device_book.hpp"
#include "services/net/sparkplug/edge_tracker.hpp"
#include "services/net/sparkplug/rebirth_policy.hpp"
#include "services/fleet/host/rows.hpp"
#include "services/fleet/host/spool.hpp"

namespace loopwarden::fleet {

using sparkplug::EdgeTracker;
using sparkplug::RebirthBudget;
using sparkplug::RebirthWait;
using sparkplug::TrackerSettings;
using sparkplug::Verdict;

struct EdgeName {
  std::string group;
  std::string edge;
  friend auto operator<=>(const EdgeName&, const EdgeName&) = default;
};

struct Position {
  std::uint8_t bd_seq = 0;
  std::uint8_t seq = 0;
  std::int64_t time_ms = 0;      // of the message, by the edge's clock
  std::int64_t received_ms = 0;  // by the host's
};

struct EdgeState {
  EdgeTracker tracker;
  RebirthWait rebirth{};
  int id = 0;  // in table edge; 0: not there yet
  std::int64_t stored_received_ms =
      0;  // of the newest message in the database when this host began
  std::map<std::string, BookPointer> books{};  // by device; "": the box
  // Data of devices whose birth was lost: read when it comes, if the connection is still the same.
  std::vector<Message> unread{};
  std::optional<std::uint8_t> unread_bd_seq{};
  Position position{};
};

// A birth or a death.
struct LifeEvent {
  EdgeName edge;
  BookPointer book;  // of a birth and of a device; null: the edge node died
  bool of_node = false;
  bool online = false;
  std::int64_t received_ms = 0;
  std::int64_t born_ms = 0;  // of a birth, by the edge's clock
};

struct IngestCounts {
  std::uint64_t messages = 0;
  std::uint64_t garbage = 0;  // no topic or payload of Sparkplug, or without seq
  std::uint64_t duplicates = 0;
  std::uint64_t old_deaths = 0;
  std::uint64_t unborn = 0;   // dropped: no birth was known
  std::uint64_t missing = 0;  // sequence numbers that never came
  std::uint64_t conflicts = 0;
  std::uint64_t unknown_metrics = 0;
  std::uint64_t bad_times = 0;
  std::uint64_t births = 0;
  std::uint64_t rebirths_asked = 0;

  IngestCounts& operator+=(const IngestCounts& other) noexcept;
};

struct Batch {
  std::map<EdgeName, EdgeState> edges;                  // those that changed, as they are after it
  std::vector<std::pair<EdgeName, BookPointer>> books;  // of births: not in the database yet
  std::vector<LifeEvent> events;                        // in order
  std::vector<EdgeName> conflicts;
  Rows rows;
  std::vector<EdgeName> ask_rebirth;  // once it is written
  std::vector<std::int64_t>
      times_ms;  // of the messages that were taken, for the delay from edge to row
  IngestCounts counts;
};

inline constexpr std::size_t kMostUnread =
    1000;  // messages of an edge node that wait for a device's birth
inline constexpr std::size_t kMostEdges = 20'000;  // of a group; messages of more are garbage

class Ingest {
 public:
  explicit Ingest(TrackerSettings tracker = {}, std::size_t most_edges = kMostEdges)
      : tracker_settings_(tracker), most_edges_(most_edges) {}

  Batch prepare(const std::vector<Arrival>& arrivals, std::int64_t now_ms);
  void commit(Batch batch);

  // An edge node that the database knows. With `books` it goes on where the database stands, for messages that an
  // earlier run left; without, its birth must come first.
  void know(const EdgeName& name, int id, const Position& position,
            std::map<std::string, BookPointer> books);
  // Another host had the group since: births must come anew.
  void forget_births();

  const std::map<EdgeName, EdgeState>& edges() const noexcept { return edges_; }
  const IngestCounts& counts() const noexcept { return counts_; }

 private:
  class Preparation;

  TrackerSettings tracker_settings_;
  std::size_t most_edges_;
  std::map<EdgeName, EdgeState> edges_;
  RebirthBudget budget_{20.0, 50.0};
  IngestCounts counts_;
};

}  // namespace loopwarden::fleet
