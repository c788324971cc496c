// SPDX-License-Identifier: Apache-2.0
// The journal of alarms, operator actions and register writes. A separate thread writes it to the
// disk.
//
// Other threads put lines into a queue in memory. A slow, full or broken disk therefore never makes
// the monitor, the control socket or the Modbus server wait. The real-time thread does not use the
// journal. While the disk fails, lines wait in memory and are tried again. A damaged file is moved
// aside and reported. A new file then starts with all stored alarm states. A file of another
// version, as after a downgrade, is not changed. Lines then wait in memory as for a failing disk.
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
  std::filesystem::path folder;      // holds journal.sqlite and alarm-state.json
  std::int64_t most_rows = 200'000;  // lines kept on the disk
  // Lines kept in memory while the disk fails. While the disk hangs, the same number again may wait
  // to be fetched.
  std::size_t most_waiting = 10'000;
  std::chrono::milliseconds retry{5000};  // between attempts at a failing disk
};

struct JournalStatus {
  std::uint64_t written = 0;  // lines on the disk since the start
  std::uint64_t waiting = 0;  // lines in memory
  std::uint64_t lost = 0;     // lines that did not fit into memory either
  std::uint64_t damaged = 0;  // files moved aside
  std::string error;          // why lines are waiting; empty: they are not, or only for a moment
};

// Whether a line is on the disk.
enum class Written : std::uint8_t {
  not_yet,
  yes,
  no,  // the disk fails or hangs, or the journal is ending
};

class Journal {
 public:
  explicit Journal(JournalSettings settings);
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;
  ~Journal() { stop(); }

  // Call it before start(). Opens the file and returns the stored alarm states from the newer of
  // the two copies. Errors of the disk appear in status(); they are never thrown.
  AlarmStates open();
  void start();
  // Writes the waiting lines if the disk accepts them, and ends the thread.
  void stop();
  // Does the same as stop(), for at most `patience`. Returns false if the disk hangs.
  bool stop_for(std::chrono::milliseconds patience);

  // Adds a line. Returns its ticket. Repeated refusals are omitted (repeated_refusals.hpp). From
  // any thread except the real-time one.
  std::uint64_t post(JournalEntry entry);
  // Returns the state of all lines up to `ticket`. Does not wait.
  Written written(std::uint64_t ticket) const;
  // Waits until all lines up to `ticket` are on the disk. Returns false at once while the disk
  // fails or hangs, and when `patience` has passed.
  bool wait_written(std::uint64_t ticket, std::chrono::milliseconds patience);

  JournalStatus status() const;
  // Returns the newest lines from the disk, newest first; empty while it can't be read.
  std::vector<JournalRow> newest(std::size_t most, const std::string& loop = {}) const;
  // Does the same for the lines that match the query.
  std::vector<JournalRow> search(const JournalQuery& query) const;
  // Returns the newest alarms raised from `from_ms` to before `to_ms`, newest first.
  std::vector<alarm::AlarmCame> came(std::int64_t from_ms, std::int64_t to_ms,
                                     std::size_t most) const;
  std::filesystem::path path() const { return settings_.folder / "journal.sqlite"; }

 private:
  Written written_locked(std::uint64_t ticket) const;
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
  std::uint64_t posted_ = 0;   // tickets issued
  std::uint64_t taken_ = 0;    // tickets up to this one left the queue
  std::uint64_t settled_ = 0;  // tickets up to this one are on the disk, or were lost
  AlarmStates crowded_out_;    // memories of lines that the full queue has lost
  JournalStatus status_;
  std::size_t in_hand_ = 0;  // lines that the journal's thread has taken but not written
  bool quit_ = false;

  // For the journal's thread only (and open(), before it).
  std::unique_ptr<JournalFile> file_;
  std::vector<JournalEntry> waiting_;
  AlarmStates states_;          // all states, for a new file
  AlarmStates changed_states_;  // of the waiting lines
  std::chrono::steady_clock::time_point retry_at_{};
  std::string reported_;
  base::DiskWait wait_;

  base::Thread thread_;
};

}  // namespace loopwarden::daemon::journal
