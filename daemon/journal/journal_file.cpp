// SPDX-License-Identifier: Apache-2.0
#include "daemon/journal/journal_file.hpp"

#include <fmt/format.h>
#include <sqlite3.h>

#include <array>
#include <utility>

namespace loopwarden::daemon::journal {
namespace {

using monitor::AlarmMemory;
using monitor::AlarmState;

constexpr int kSchemaVersion = 1;
constexpr int kApplicationId = 0x4C574A31;  // "LWJ1": tells file(1) and us whose database it is

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

// By SQLite's lower(), which knows ASCII alone.
// Fields are kept apart by a character that nobody writes.
constexpr const char* kContains =
    "instr(lower(ifnull(loop, '') || char(31) || ifnull(alarm, '') || char(31) || ifnull(peer, '') "
    "|| char(31) || "
    "ifnull(what, '') || char(31) || ifnull(old_value, '') || char(31) || ifnull(new_value, '') || "
    "char(31) || "
    "ifnull(reason, '') || char(31) || ifnull(result, '')), lower(?7)) > 0";

JournalEntry::Kind kind_of(const std::string& text) {
  using Kind = JournalEntry::Kind;
  for (const Kind kind : {Kind::alarm, Kind::operator_action, Kind::register_write}) {
    if (text == to_text(kind)) return kind;
  }
  return Kind::system;
}

}  // namespace

// A prepared statement that finalises itself.
class JournalFile::Statement {
 public:
  Statement(JournalFile& file, const std::string& sql) : file_(file) {
    if (sqlite3_prepare_v2(file.db_, sql.c_str(), -1, &statement_, nullptr) != SQLITE_OK) {
      file.fail("prepare");
    }
  }
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;
  ~Statement() { sqlite3_finalize(statement_); }

  void bind(int column, const std::string& text) {
    // An empty text is NULL: the column does not apply.
    const int result = text.empty()
                           ? sqlite3_bind_null(statement_, column)
                           : sqlite3_bind_text(statement_, column, text.data(),
                                               static_cast<int>(text.size()), SQLITE_TRANSIENT);
    if (result != SQLITE_OK) file_.fail("bind");
  }
  void bind(int column, std::int64_t number) {
    if (sqlite3_bind_int64(statement_, column, number) != SQLITE_OK) file_.fail("bind");
  }
  void bind(int column, double number) {
    if (sqlite3_bind_double(statement_, column, number) != SQLITE_OK) file_.fail("bind");
  }
  // True while there are rows.
  bool step() {
    const int result = sqlite3_step(statement_);
    if (result == SQLITE_ROW) return true;
    if (result != SQLITE_DONE) file_.fail("step");
    return false;
  }
  void run_once() {
    step();
    sqlite3_reset(statement_);
    sqlite3_clear_bindings(statement_);
  }
  std::string text(int column) const {
    const unsigned char* bytes = sqlite3_column_text(statement_, column);
    return bytes == nullptr ? std::string()
                            : std::string(bytes, bytes + sqlite3_column_bytes(statement_, column));
  }
  std::int64_t integer(int column) const { return sqlite3_column_int64(statement_, column); }
  double number(int column) const { return sqlite3_column_double(statement_, column); }
  bool is_null(int column) const { return sqlite3_column_type(statement_, column) == SQLITE_NULL; }

 private:
  JournalFile& file_;
  sqlite3_stmt* statement_ = nullptr;
};

JournalFile::JournalFile(const std::filesystem::path& path, std::int64_t most_rows)
    : JournalFile(path, Access::write, most_rows) {
  execute("PRAGMA journal_mode=WAL");
  execute("PRAGMA synchronous=FULL");
  execute("PRAGMA journal_size_limit=1048576");
  check();
}

JournalFile::JournalFile(const std::filesystem::path& path, Access access, std::int64_t most_rows)
    : most_rows_(most_rows) {
  const int flags =
      access == Access::read ? SQLITE_OPEN_READONLY : SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE;
  if (sqlite3_open_v2(path.c_str(), &db_, flags | SQLITE_OPEN_NOMUTEX, nullptr) != SQLITE_OK) {
    const std::string why = sqlite3_errmsg(db_);
    sqlite3_close(db_);  // the destructor does not run for a constructor that throws
    throw JournalError(JournalError::Kind::unavailable, why);
  }
  sqlite3_extended_result_codes(db_, 1);
  sqlite3_busy_timeout(db_, 1000);  // ms, for a backup that holds it
}

JournalFile::~JournalFile() { sqlite3_close(db_); }

void JournalFile::check() {
  std::int64_t version = 0;
  std::int64_t application = 0;
  {
    Statement read(*this, "PRAGMA user_version");
    if (read.step()) version = read.integer(0);
    Statement id(*this, "PRAGMA application_id");
    if (id.step()) application = id.integer(0);
  }
  if (version == 0 && application == 0) {
    bool empty = true;
    {
      Statement any(*this, "SELECT 1 FROM sqlite_master LIMIT 1");
      empty = !any.step();
    }
    if (!empty) throw JournalError(JournalError::Kind::damaged, "it is no journal of ours");
    make_tables();
    return;
  }
  if (application != kApplicationId || version != kSchemaVersion) {
    throw JournalError(JournalError::Kind::damaged,
                       fmt::format("it is no journal of version {}", kSchemaVersion));
  }
  Statement quick(*this, "PRAGMA quick_check(1)");
  if (!quick.step() || quick.text(0) != "ok") {
    throw JournalError(JournalError::Kind::damaged, quick.text(0));
  }
}

void JournalFile::make_tables() {
  execute("BEGIN IMMEDIATE");
  execute(kTables);
  execute(fmt::format("PRAGMA application_id={}", kApplicationId).c_str());
  execute(fmt::format("PRAGMA user_version={}", kSchemaVersion).c_str());
  execute("COMMIT");
}

void JournalFile::execute(const char* sql) {
  if (sqlite3_exec(db_, sql, nullptr, nullptr, nullptr) != SQLITE_OK) fail("execute");
}

void JournalFile::fail(const char* step) const {
  const int code = sqlite3_errcode(db_) & 0xFF;
  // SQLITE_ERROR: what the file says of its tables is not what we made.
  const bool damaged = code == SQLITE_CORRUPT || code == SQLITE_NOTADB || code == SQLITE_ERROR;
  throw JournalError(damaged ? JournalError::Kind::damaged : JournalError::Kind::unavailable,
                     fmt::format("{}: {}", step, sqlite3_errmsg(db_)));
}

void JournalFile::add(Statement& insert, const JournalEntry& entry) {
  insert.bind(1, entry.utc_ms);
  insert.bind(2, std::string(to_text(entry.kind)));
  insert.bind(3, entry.loop);
  insert.bind(4, entry.alarm);
  insert.bind(5, entry.from);
  insert.bind(6, entry.to);
  if (entry.severity_percent) insert.bind(7, *entry.severity_percent);
  insert.bind(8, entry.peer);
  insert.bind(9, entry.what);
  insert.bind(10, entry.old_value);
  insert.bind(11, entry.new_value);
  insert.bind(12, entry.result);
  insert.bind(13, entry.reason);
  insert.run_once();
}

void JournalFile::write(std::span<const JournalEntry> entries, const AlarmStates& states) {
  execute("BEGIN IMMEDIATE");
  try {
    Statement insert(*this,
                     "INSERT INTO journal(utc_ms, kind, loop, alarm, from_state, to_state, "
                     "severity_percent, peer, what, old_value, new_value, result, reason) "
                     "VALUES(?,?,?,?,?,?,?,?,?,?,?,?,?)");
    for (const JournalEntry& entry : entries) add(insert, entry);
    Statement keep(*this, "INSERT OR REPLACE INTO alarm_state VALUES(?,?,?,?,?,?,?,?,?)");
    for (const auto& [key, memory] : states.memories) {
      keep.bind(1, key.first);
      keep.bind(2, key.second);
      keep.bind(3, static_cast<std::int64_t>(memory.raised));
      keep.bind(4, memory.shelved_until_ms);
      keep.bind(5, memory.raised_ms);
      keep.bind(6, memory.changed_ms);
      keep.bind(7, static_cast<std::int64_t>(memory.times_raised));
      keep.bind(8, memory.severity_percent);
      keep.bind(9, memory.worst_severity_percent);
      keep.run_once();
    }
    Statement revision(*this, "UPDATE alarm_revision SET revision = ?");
    revision.bind(1, static_cast<std::int64_t>(states.revision));
    revision.run_once();
    Statement trim(*this, "DELETE FROM journal WHERE id <= (SELECT max(id) FROM journal) - ?");
    trim.bind(1, most_rows_);
    trim.run_once();
    execute("COMMIT");
  } catch (...) {
    // Some errors have rolled back already; a second time does no harm.
    sqlite3_exec(db_, "ROLLBACK", nullptr, nullptr, nullptr);
    throw;
  }
}

AlarmStates JournalFile::read_states() {
  AlarmStates states;
  Statement revision(*this, "SELECT revision FROM alarm_revision");
  if (revision.step()) states.revision = static_cast<std::uint64_t>(revision.integer(0));
  Statement read(*this, "SELECT * FROM alarm_state");
  while (read.step()) {
    const std::int64_t state = read.integer(2);
    AlarmMemory memory;
    // A number that is no state is left to Alarm, which takes none of it.
    memory.raised = static_cast<AlarmState>(state >= 0 && state <= 255 ? state : 255);
    memory.shelved_until_ms = read.integer(3);
    memory.raised_ms = read.integer(4);
    memory.changed_ms = read.integer(5);
    memory.times_raised = static_cast<std::uint32_t>(read.integer(6));
    memory.severity_percent = read.number(7);
    memory.worst_severity_percent = read.number(8);
    states.memories[{read.text(0), read.text(1)}] = memory;
  }
  return states;
}

JournalRow JournalFile::row_of(const Statement& read) {
  return {
      .id = read.integer(0),
      .entry = {.kind = kind_of(read.text(2)),
                .utc_ms = read.integer(1),
                .loop = read.text(3),
                .alarm = read.text(4),
                .from = read.text(5),
                .to = read.text(6),
                .severity_percent = read.is_null(7) ? std::nullopt : std::optional(read.number(7)),
                .peer = read.text(8),
                .what = read.text(9),
                .old_value = read.text(10),
                .new_value = read.text(11),
                .result = read.text(12),
                .reason = read.text(13),
                .memory = std::nullopt}};
}

std::vector<JournalRow> JournalFile::search(const JournalQuery& query) {
  // Values are parameters; which conditions there are is all that is put together here.
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
  Statement read(*this, fmt::format("SELECT * FROM journal{} ORDER BY id DESC LIMIT ?1", where));
  read.bind(1, static_cast<std::int64_t>(query.most));
  // A parameter of a condition that is not there can't be bound.
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
  return JournalFile(path, Access::read, 0).search(query);
}

std::filesystem::path move_aside(const std::filesystem::path& path, std::int64_t utc_ms) {
  std::filesystem::path aside = fmt::format("{}.damaged-{}", path.string(), utc_ms);
  std::filesystem::rename(path, aside);
  // A log left behind would be played into the new database.
  for (const char* belongs : {"-wal", "-shm"}) {
    if (std::filesystem::exists(path.string() + belongs)) {
      std::filesystem::rename(path.string() + belongs, aside.string() + belongs);
    }
  }
  return aside;
}

}  // namespace loopwarden::daemon::journal
