// SPDX-License-Identifier: Apache-2.0
// Reports of a loop's record that somebody asked for, made one at a time by `loopwarden KIND --background`.
//
// Whoever asks never waits for the disk: all of that is done by the thread that calls run_next(), lw-explain, while no explanation of
// an alarm is due. One that comes due ends the report at work, which begins anew behind it. Each report has a folder of its own;
// of a loop the newest `kept` stay. One that a restart of the daemon ended is told as failed.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "daemon/reports/report.hpp"

namespace loopwarden::daemon::reports {

struct DeskSettings {
  std::filesystem::path program;  // loopwarden; empty: there is none
  std::filesystem::path folder;   // of all reports
  std::filesystem::path socket;   // where loopwarden asks for the loop's ranges and segments
  std::size_t most_waiting = 4;   // of all loops
  std::chrono::milliseconds most_time{900'000};  // of one
  std::size_t kept = 10;
};

struct ReportCallbacks {
  std::function<std::int64_t()> now_ms;  // UTC
  std::function<void()> wake;            // there is something to do
  std::function<void(const Report&)> ended;
  // Whether something that the loops work with, or will from the next start on, lies in the folder. May wait for the disk.
  std::function<bool(const std::filesystem::path& folder)> in_use;
};

class ReportDesk {
 public:
  // True after at most the time given: leave off.
  using Stop = std::function<bool(std::chrono::milliseconds)>;

  ReportDesk(DeskSettings settings, ReportCallbacks callbacks)
      : settings_(std::move(settings)), callbacks_(std::move(callbacks)) {}

  // Any thread.
  bool has_program() const noexcept { return !settings_.program.empty(); }
  std::size_t most_waiting() const noexcept { return settings_.most_waiting; }
  // With its name and place; nothing: as many as may wait do.
  std::optional<Report> post(Order order);
  // The newest first; nothing: those of before the start are not read yet.
  std::optional<std::vector<Report>> of(const std::string& loop) const;

  // One thread. Makes the next report; false: there is nothing to do. Where it has been told to stop, the report waits again.
  bool run_next(const Stop& stop);

 private:
  struct Entry {
    Report report;
    bool on_disk = false;
  };
  std::filesystem::path folder_of(const Report& report) const {
    return settings_.folder / report.name;
  }
  std::vector<std::string> arguments_for(const Report& report) const;
  void load();
  void write(const Report& report) const noexcept;
  void write_new();
  std::optional<Report> begin();
  // What became of it; nothing: it was told to stop.
  std::optional<Report> make(Report report, const Stop& stop);
  void look_at_progress(const Report& report);
  void change(const Report& report);
  void remove_old(const std::string& loop);
  std::size_t waiting_before(const Report& report) const;

  DeskSettings settings_;
  ReportCallbacks callbacks_;
  mutable std::mutex mutex_;  // held for copies in memory only
  std::vector<Entry> all_;    // in the order in which they were asked for
  bool is_loaded_ = false;    // all_ has those of before the start
};

}  // namespace loopwarden::daemon::reports
