// SPDX-License-Identifier: Apache-2.0
// The journal's SQLite database, used by one thread.
//
// journal_mode=WAL and synchronous=FULL: each transaction is on the disk when it returns, so that a
// power failure takes back nothing that an operator was told is done (NORMAL would keep the file sound
// but lose the newest transactions). Writes are appended to the write-ahead log, one fsync each, which
// is as kind to flash as it gets; readers such as `sqlite3` or a backup never make the writer wait.
// A line and the alarm state that follows from it are one transaction.
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

// Which lines; what is empty or not given does not matter.
struct JournalQuery {
  std::size_t most = 50;
  std::string loop{};
  std::optional<std::int64_t> before_id{};  // older ones, for the next page
  std::optional<JournalEntry::Kind> kind{};
  std::string text{};  // in any of a line's words; upper and lower case of ASCII are the same
  std::optional<std::int64_t> from_ms{};  // UTC, this moment included
  std::optional<std::int64_t> to_ms{};    // UTC, this moment included
};

struct JournalRow {
  std::int64_t id = 0;
  JournalEntry entry;
};

class JournalFile {
 public:
  // Opens or makes the file and checks it. Keeps the newest `most_rows` lines.
  explicit JournalFile(const std::filesystem::path& path, std::int64_t most_rows);
  // The newest lines that the query fits of a journal that another thread writes, newest first.
  static std::vector<JournalRow> search(const std::filesystem::path& path,
                                        const JournalQuery& query);
  // The newest alarms that came from `from_ms` to before `to_ms` (UTC), newest first.
  static std::vector<alarm::AlarmCame> came(const std::filesystem::path& path,
                                                          std::int64_t from_ms, std::int64_t to_ms,
                                                          std::size_t most);
  JournalFile(const JournalFile&) = delete;
  JournalFile& operator=(const JournalFile&) = delete;

  // All in one transaction, or nothing and a sqlite::Error.
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
