// SPDX-License-Identifier: Apache-2.0
#include "daemon/journal/journal_file.hpp"

#include <fmt/format.h>

#include <chrono>
#include <utility>

#include "daemon/journal/incident_text.hpp"

namespace loopwarden::daemon::journal {
namespace {

using alarm::AlarmMemory;
using alarm::AlarmState;
using sqlite::Statement;

constexpr const char* kTables = R"(
CREATE TABLE journal(
  id INTEGER PRIMARY KEY AUTOINCREMENT,
  utc_ms INTEGER NOT NULL,
  kind TEXT NOT NULL,
  loop TEXT, alarm TEXT, from_state TEXT, to_state TEXT, severity_percent REAL,
  peer TEXT, what TEXT, old_value TEXT, new_value TEXT, result TEXT, reason TEXT);
CREATE INDEX journal_loop ON journal(loop, id);
CREATE TRIGGER journal_is_append_only BEFORE UPDATE ON journal
  BEGIN SELECT RAISE(ABORT, 'the journal is append-only'); END;
CREATE TABLE alarm_state(
  loop TEXT NOT NULL, alarm TEXT NOT NULL, state INTEGER NOT NULL,
  shelved_until_ms INTEGER NOT NULL, raised_ms INTEGER NOT NULL, changed_ms INTEGER NOT NULL,
  times_raised INTEGER NOT NULL, severity_percent REAL NOT NULL,
  worst_severity_percent REAL NOT NULL,
  PRIMARY KEY(loop, alarm)) WITHOUT ROWID;
CREATE TABLE alarm_revision(only INTEGER PRIMARY KEY CHECK(only = 1), revision INTEGER NOT NULL);
INSERT INTO alarm_revision VALUES(1, 0);
)";

// An additional table for version 1. Older programs read and write the file without it.
constexpr const char* kIncidents =
    "CREATE TABLE IF NOT EXISTS incident(loop TEXT PRIMARY KEY, state TEXT NOT NULL) WITHOUT ROWID";
// Contains only the columns for the alarm figures, which are answered from the index without the
// table.
constexpr const char* kCameIndex =
    "CREATE INDEX IF NOT EXISTS journal_came "
    "ON journal(utc_ms, loop, alarm, from_state, kind, to_state) "
    "WHERE kind = 'alarm' AND to_state = 'unacknowledged'";
// Selects lines that raised an alarm. Excludes alarms that ended their shelving.
constexpr const char* kCame =
    "SELECT utc_ms, loop, alarm FROM journal WHERE kind = 'alarm' AND to_state = 'unacknowledged' "
    "AND from_state NOT IN ('unacknowledged', 'acknowledged', 'shelved') "
    "AND utc_ms >= ?1 AND utc_ms < ?2 ORDER BY utc_ms DESC LIMIT ?3";

constexpr sqlite::Schema kSchema{"journal", 0x4C574A31 /* "LWJ1" */, 1, kTables};

// Compares with SQLite's lower(), which handles ASCII only. A character that users can't type
// separates the fields.
constexpr const char* kContains =
    "instr(lower(ifnull(loop, '') || char(31) || ifnull(alarm, '') || char(31) || ifnull(peer, '') "
    "|| char(31) || "
    "ifnull(what, '') || char(31) || ifnull(old_value, '') || char(31) || ifnull(new_value, '') || "
    "char(31) || "
    "ifnull(reason, '') || char(31) || ifnull(result, '')), lower(?7)) > 0";

JournalEntry::Kind kind_of(const std::string& text) {
  using Kind = JournalEntry::Kind;
  for (const Kind kind : {Kind::alarm, Kind::operator_action, Kind::register_write, Kind::test}) {
    if (text == to_text(kind)) return kind;
  }
  return Kind::system;
}

// Converts an empty text to NULL: the column does not apply.
std::optional<std::string> given(const std::string& text) {
  return text.empty() ? std::nullopt : std::optional(text);
}

void add(Statement& insert, const JournalEntry& entry) {
  insert.run(entry.utc_ms, std::string(to_text(entry.kind)), given(entry.loop), given(entry.alarm),
             given(entry.from), given(entry.to), entry.severity_percent, given(entry.peer),
             given(entry.what), given(entry.old_value), given(entry.new_value), given(entry.result),
             given(entry.reason));
}

}  // namespace

JournalFile::JournalFile(const std::filesystem::path& path, std::int64_t most_rows)
    : JournalFile(path, sqlite::Access::write, most_rows) {
  database_.adopt(kSchema, sqlite::Sync::full);
  database_.execute(kIncidents);
  database_.execute(kCameIndex);
}

JournalFile::JournalFile(const std::filesystem::path& path, sqlite::Access access,
                         std::int64_t most_rows)
    : database_(path, access, std::chrono::seconds(1)), most_rows_(most_rows) {}

void JournalFile::write(std::span<const JournalEntry> entries, const AlarmStates& states) {
  sqlite::Transaction transaction(database_);
  Statement insert(database_,
                   "INSERT INTO journal(utc_ms, kind, loop, alarm, from_state, to_state, "
                   "severity_percent, peer, what, old_value, new_value, result, reason) "
                   "VALUES(?,?,?,?,?,?,?,?,?,?,?,?,?)");
  for (const JournalEntry& entry : entries) add(insert, entry);
  Statement keep(database_, "INSERT OR REPLACE INTO alarm_state VALUES(?,?,?,?,?,?,?,?,?)");
  for (const auto& [key, memory] : states.memories) {
    keep.run(key.first, key.second, static_cast<std::int64_t>(memory.raised),
             memory.shelved_until_ms, memory.raised_ms, memory.changed_ms, memory.times_raised,
             memory.severity_percent, memory.worst_severity_percent);
  }
  Statement incident(database_, "INSERT OR REPLACE INTO incident VALUES(?,?)");
  for (const auto& [loop, state] : states.incidents) incident.run(loop, write_incident(state));
  Statement(database_, "UPDATE alarm_revision SET revision = ?", states.revision).run();
  Statement(database_, "DELETE FROM journal WHERE id <= (SELECT max(id) FROM journal) - ?",
            most_rows_)
      .run();
  transaction.commit();
}

AlarmStates JournalFile::read_states() {
  AlarmStates states;
  Statement revision(database_, "SELECT revision FROM alarm_revision");
  if (revision.step()) states.revision = static_cast<std::uint64_t>(revision.integer(0));
  Statement read(database_, "SELECT * FROM alarm_state");
  while (read.step()) {
    const std::int64_t state = read.integer(2);
    AlarmMemory memory;
    // An invalid state number is passed on to Alarm, which ignores it.
    memory.raised = static_cast<AlarmState>(state >= 0 && state <= 255 ? state : 255);
    memory.shelved_until_ms = read.integer(3);
    memory.raised_ms = read.integer(4);
    memory.changed_ms = read.integer(5);
    memory.times_raised = static_cast<std::uint32_t>(read.integer(6));
    memory.severity_percent = read.number(7);
    memory.worst_severity_percent = read.number(8);
    states.memories[{read.text(0), read.text(1)}] = memory;
  }
  Statement incidents(database_, "SELECT loop, state FROM incident");
  while (incidents.step()) {
    if (auto known = read_incident(incidents.text(1))) {
      states.incidents[incidents.text(0)] = std::move(*known);
    }
  }
  return states;
}

JournalRow JournalFile::row_of(const sqlite::Statement& read) {
  return {.id = read.integer(0),
          .entry = {.kind = kind_of(read.text(2)),
                    .utc_ms = read.integer(1),
                    .loop = read.text(3),
                    .alarm = read.text(4),
                    .from = read.text(5),
                    .to = read.text(6),
                    .severity_percent = read.number_or_null(7),
                    .peer = read.text(8),
                    .what = read.text(9),
                    .old_value = read.text(10),
                    .new_value = read.text(11),
                    .result = read.text(12),
                    .reason = read.text(13),
                    .memory = std::nullopt,
                    .incident = std::nullopt}};
}

std::vector<JournalRow> JournalFile::search(const JournalQuery& query) {
  // Only the choice of conditions is composed here. Values are parameters.
  std::string where;
  const auto with = [&](bool given, const char* condition) {
    if (given) where += fmt::format("{} {}", where.empty() ? " WHERE" : " AND", condition);
  };
  with(!query.loop.empty(), "loop = ?2");
  with(query.before_id.has_value(), "id < ?3");
  with(query.kind.has_value(), "kind = ?4");
  with(query.from_ms.has_value(), "utc_ms >= ?5");
  with(query.to_ms.has_value(), "utc_ms <= ?6");
  with(!query.text.empty(), kContains);
  Statement read(database_,
                 fmt::format("SELECT * FROM journal{} ORDER BY id DESC LIMIT ?1", where));
  read.bind(1, query.most);
  // A parameter must not be bound if its condition is absent.
  if (!query.loop.empty()) read.bind(2, query.loop);
  if (query.before_id) read.bind(3, *query.before_id);
  if (query.kind) read.bind(4, std::string(to_text(*query.kind)));
  if (query.from_ms) read.bind(5, *query.from_ms);
  if (query.to_ms) read.bind(6, *query.to_ms);
  if (!query.text.empty()) read.bind(7, query.text);
  std::vector<JournalRow> rows;
  while (read.step()) rows.push_back(row_of(read));
  return rows;
}

std::vector<JournalRow> JournalFile::search(const std::filesystem::path& path,
                                            const JournalQuery& query) {
  JournalFile file(path, sqlite::Access::read, 0);
  file.database_.demand_schema(kSchema);
  return file.search(query);
}

std::vector<alarm::AlarmCame> JournalFile::came(const std::filesystem::path& path,
                                                std::int64_t from_ms, std::int64_t to_ms,
                                                std::size_t most) {
  JournalFile file(path, sqlite::Access::read, 0);
  file.database_.demand_schema(kSchema);
  Statement read(file.database_, kCame, from_ms, to_ms, most);
  std::vector<alarm::AlarmCame> all;
  while (read.step()) all.push_back({read.integer(0), read.text(1), read.text(2)});
  return all;
}

}  // namespace loopwarden::daemon::journal
