// SPDX-License-Identifier: Apache-2.0
// The journal of alarms, operator actions and register writes, with a thread of its own for the disk.
//
// Everyone else only puts lines into a queue in memory: no disk, however slow, full or broken, makes
// the monitor, the control socket or the Modbus server wait, and the real-time thread does not know
// the journal. While the disk refuses, lines wait in memory and are tried again. A damaged file is
// moved aside, reported, and a new one begun with all that the alarms remember. One of another version, as after a
// downgrade, stays as it is, and lines wait in memory as where the disk refuses.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "daemon/journal/alarm_state_file.hpp"
#include "daemon/journal/journal_entry.hpp"
#include "daemon/journal/journal_file.hpp"
#include "daemon/journal/repeated_refusals.hpp"
#include "base/disk_wait.hpp"
#include "base/thread.hpp"

namespace loopwarden::daemon::journal {

struct JournalSettings {
  std::filesystem::path folder;           // holds journal.sqlite and alarm-state.json
  std::int64_t most_rows = 200'000;       // lines kept on the disk
  std::size_t most_waiting = 10'000;      // lines kept in memory while the disk refuses; while it
                                          // hangs, as many that nobody has fetched yet
  std::chrono::milliseconds retry{5000};  // between attempts at a disk that refuses
};

struct JournalStatus {
  std::uint64_t written = 0;  // lines on the disk since the start
  std::uint64_t waiting = 0;  // lines in memory
  std::uint64_t lost = 0;     // lines that found no room in memory either
  std::uint64_t damaged = 0;  // files moved aside
  std::string error;          // why lines are waiting; empty: they are not, or for a moment only
};

// Whether a line is on the disk.
enum class Written : std::uint8_t {
  not_yet,
  yes,
  no,  // the disk refuses or hangs, or the journal is ending
};

class Journal {
 public:
  explicit Journal(JournalSettings settings);
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;
  ~Journal() { stop(); }

  // Before start(): opens the file and returns what the alarms remember, the newer of the two copies.
  // Trouble with the disk shows in status(), it is never thrown.
  AlarmStates open();
  void start();
  // Writes what is waiting, if the disk takes it, and ends the thread.
  void stop();
  // As stop(), for at most `patience`; false if the disk hangs.
  bool stop_for(std::chrono::milliseconds patience);

  // Any thread but the real-time one. Returns a number to wait for. Refusals that repeat are left
  // out (repeated_refusals.hpp).
  std::uint64_t post(JournalEntry entry);
  // Of all lines up to `ticket`. Waits for nothing.
  Written written(std::uint64_t ticket) const;
  // True once all up to `ticket` is on the disk; false at once while the disk refuses or hangs, or
  // when `patience` has run out.
  bool wait_written(std::uint64_t ticket, std::chrono::milliseconds patience);

  JournalStatus status() const;
  // The newest lines, newest first, from the disk; empty while it can't be read.
  std::vector<JournalRow> newest(std::size_t most, const std::string& loop = {}) const;
  // The same of the lines that the query fits.
  std::vector<JournalRow> search(const JournalQuery& query) const;
  // The newest alarms that came from `from_ms` to before `to_ms`, newest first.
  std::vector<alarm::AlarmCame> came(std::int64_t from_ms, std::int64_t to_ms,
                                                   std::size_t most) const;
  std::filesystem::path path() const { return settings_.folder / "journal.sqlite"; }

 private:
  Written written_locked(std::uint64_t ticket) const;
  void ask_to_end();
  void run();
  bool take_waiting();
  void make_room();
  bool write_waiting();
  void open_file();
  bool replace_damaged(const std::string& why);
  void save_copy();
  void failed(const std::string& why);

  JournalSettings settings_;
  AlarmStateFile copy_;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  RepeatedRefusals refusals_;
  std::deque<JournalEntry> queue_;
  std::uint64_t posted_ = 0;   // tickets given
  std::uint64_t taken_ = 0;    // tickets up to this one left the queue
  std::uint64_t settled_ = 0;  // tickets up to this one are on the disk, or were lost
  AlarmStates crowded_out_;    // memories of lines that the full queue has lost
  JournalStatus status_;
  std::size_t in_hand_ = 0;  // lines that the journal's thread has taken, and not written
  bool quit_ = false;

  // The journal's thread only (and open(), before it).
  std::unique_ptr<JournalFile> file_;
  std::vector<JournalEntry> waiting_;
  AlarmStates states_;          // all, for a new file
  AlarmStates changed_states_;  // of the lines that wait
  std::chrono::steady_clock::time_point retry_at_{};
  std::string reported_;
  base::DiskWait wait_;

  base::Thread thread_;
};

}  // namespace loopwarden::daemon::journal
