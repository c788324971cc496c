// SPDX-License-Identifier: Apache-2.0
// The journal's SQLite database, for one thread.
//
// journal_mode=WAL and synchronous=FULL: a transaction is on the disk when the call returns. A
// power failure therefore never undoes an action that was confirmed to an operator. NORMAL would
// keep the file valid but lose the newest transactions. Writes are appended to the write-ahead log
// with one fsync each, which wears flash memory least. Readers such as `sqlite3` or a backup never
// make the writer wait. A line and the resulting alarm state are one transaction.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "daemon/journal/journal_entry.hpp"
#include "base/sqlite/sqlite.hpp"
#include "model/alarm/alarm_figures.hpp"

namespace loopwarden::daemon::journal {

// Selects lines. Empty or missing fields match all lines.
struct JournalQuery {
  std::size_t most = 50;
  std::string loop{};
  std::optional<std::int64_t> before_id{};  // lines with a lower id, for the next page
  std::optional<JournalEntry::Kind> kind{};
  std::string text{};                     // matches any field of a line; ignores case for ASCII
  std::optional<std::int64_t> from_ms{};  // UTC, inclusive
  std::optional<std::int64_t> to_ms{};    // UTC, inclusive
};

struct JournalRow {
  std::int64_t id = 0;
  JournalEntry entry;
};

class JournalFile {
 public:
  // Opens or creates the file and checks it. Keeps the newest `most_rows` lines.
  explicit JournalFile(const std::filesystem::path& path, std::int64_t most_rows);
  // Returns the newest matching lines of a journal that another thread writes, newest first.
  static std::vector<JournalRow> search(const std::filesystem::path& path,
                                        const JournalQuery& query);
  // Returns the newest alarms raised from `from_ms` to before `to_ms` (UTC), newest first.
  static std::vector<alarm::AlarmCame> came(const std::filesystem::path& path, std::int64_t from_ms,
                                            std::int64_t to_ms, std::size_t most);
  JournalFile(const JournalFile&) = delete;
  JournalFile& operator=(const JournalFile&) = delete;

  // Writes all in one transaction. On failure it writes none and throws sqlite::Error.
  void write(std::span<const JournalEntry> entries, const AlarmStates& states);
  AlarmStates read_states();

 private:
  JournalFile(const std::filesystem::path& path, sqlite::Access access, std::int64_t most_rows);
  std::vector<JournalRow> search(const JournalQuery& query);
  static JournalRow row_of(const sqlite::Statement& read);

  sqlite::Database database_;
  std::int64_t most_rows_;
};

}  // namespace loopwarden::daemon::journal
