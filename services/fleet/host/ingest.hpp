// SPDX-License-Identifier: Apache-2.0
// Converts messages from the broker into changes of the database, for the edge nodes of one group.
// It uses no I/O and no clock.
//
//   Batch batch = ingest.prepare(arrivals, now)   on copies of the edges' states
//   ... written to the database in one transaction ...
//   ingest.commit(batch)                          applies the changed states
//
// A batch that could not be written is discarded and prepared again later, with the same result.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
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
  std::int64_t received_ms = 0;  // by the host's clock
};

struct EdgeState {
  EdgeTracker tracker;
  RebirthWait rebirth{};
  int id = 0;  // in table edge; 0: not in the table yet
  std::int64_t stored_received_ms =
      0;  // time of the newest message in the database when this host started
  std::map<std::string, BookPointer> books{};  // by device; "": the box
  // Data of devices whose birth was lost. They are read after the birth arrives, if the connection
  // is still the same.
  std::vector<Message> unread{};
  std::optional<std::uint8_t> unread_bd_seq{};
  Position position{};
};

// A birth or a death.
struct LifeEvent {
  EdgeName edge;
  BookPointer book;  // births and deaths of devices; null: the edge node died
  bool of_node = false;
  bool online = false;
  std::int64_t received_ms = 0;
  std::int64_t born_ms = 0;  // births only, by the edge's clock
};

struct IngestCounts {
  std::uint64_t messages = 0;
  std::uint64_t garbage = 0;  // neither topic nor payload of Sparkplug, or without seq
  std::uint64_t duplicates = 0;
  std::uint64_t old_deaths = 0;
  std::uint64_t unborn = 0;   // dropped because no birth was received
  std::uint64_t missing = 0;  // sequence numbers that never arrived
  std::uint64_t conflicts = 0;
  std::uint64_t unknown_metrics = 0;
  std::uint64_t bad_times = 0;
  std::uint64_t births = 0;
  std::uint64_t rebirths_asked = 0;

  IngestCounts& operator+=(const IngestCounts& other) noexcept;
};

struct Batch {
  std::map<EdgeName, EdgeState> edges;  // changed edges, with their state after the batch
  std::vector<std::pair<EdgeName, BookPointer>> books;  // from births: not in the database yet
  std::vector<LifeEvent> events;                        // in order
  std::vector<EdgeName> conflicts;
  Rows rows;
  std::vector<EdgeName> ask_rebirth;   // when the batch is written
  std::vector<std::int64_t> times_ms;  // of the accepted messages, for the delay from edge to row
  IngestCounts counts;
};

inline constexpr std::size_t kMostUnread =
    1000;  // messages per edge node that wait for a device's birth
// per group; messages of further edges count as garbage
inline constexpr std::size_t kMostEdges = 20'000;

class Ingest {
 public:
  explicit Ingest(TrackerSettings tracker = {}, std::size_t most_edges = kMostEdges)
      : tracker_settings_(tracker), most_edges_(most_edges) {}

  Batch prepare(const std::vector<Arrival>& arrivals, std::int64_t now_ms);
  void commit(Batch batch);

  // Adds an edge node from the database. With `books` it continues from the position in the
  // database, for messages of an earlier run. Without `books` its birth must arrive first.
  void know(const EdgeName& name, int id, const Position& position,
            std::map<std::string, BookPointer> books);
  // Requires new births, because another host had the group meanwhile.
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
