// SPDX-License-Identifier: Apache-2.0
// Makes requested reports of a loop's record one at a time, by `loopwarden KIND --background`.
//
// Requests never wait for the disk. The thread that calls run_next(), lw-explain, does all work on
// the disk while no explanation of an alarm is due. If an explanation becomes due, the running
// report is stopped and starts again after it. Each report has a separate folder. The newest `kept`
// reports per loop are kept. A report that a restart of the daemon ended is marked as failed; one
// with a due time waits again.
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

struct QueueSettings {
  std::filesystem::path program;  // path of loopwarden; empty: not found
  std::filesystem::path folder;   // folder of all reports
  std::filesystem::path socket;   // socket that gives loopwarden the loop's ranges and segments
  std::size_t most_waiting = 4;   // for all loops together
  std::chrono::milliseconds most_time{900'000};  // per report
  std::size_t kept = 10;
};

struct ReportCallbacks {
  std::function<std::int64_t()> now_ms;  // UTC
  std::function<void()> wake;            // announces work
  std::function<void(const Report&)> ended;
  // Returns whether the folder contains files that the loops use, or will use from the next start.
  // May wait for the disk.
  std::function<bool(const std::filesystem::path& folder)> in_use;
};

class ReportQueue {
 public:
  // Waits up to the given time and returns true if the work must stop.
  using Stop = std::function<bool(std::chrono::milliseconds)>;

  ReportQueue(QueueSettings settings, ReportCallbacks callbacks)
      : settings_(std::move(settings)), callbacks_(std::move(callbacks)) {}

  // From any thread.
  bool has_program() const noexcept { return !settings_.program.empty(); }
  std::size_t most_waiting() const noexcept { return settings_.most_waiting; }
  // Queues a report. Returns it with name and place; nullopt if the queue is full.
  std::optional<Report> post(Order order);
  // Queues a report that is made at order.due_ms. If one of the same loop and kind waits already,
  // it is delayed until then instead.
  void post_later(Order order);
  // Announces work if a report has become due. To be called regularly.
  void look_at_due() const;
  // Returns a loop's reports, newest first; nullopt while those from before the start are not
  // loaded.
  std::optional<std::vector<Report>> of(const std::string& loop) const;

  // Makes the next report. Returns false if no work is left. A report that is stopped waits again.
  // For one thread only.
  bool run_next(const Stop& stop);

 private:
  struct Entry {
    Report report;
    bool on_disk = false;
  };
  Report add(Order order, std::int64_t now_ms);
  std::filesystem::path folder_of(const Report& report) const {
    return settings_.folder / report.name;
  }
  std::vector<std::string> arguments_for(const Report& report) const;
  void load();
  void write(const Report& report) const noexcept;
  void write_new();
  std::optional<Report> begin();
  // Returns the result; nullopt if it was stopped.
  std::optional<Report> make(Report report, const Stop& stop);
  void look_at_progress(const Report& report);
  void change(const Report& report);
  void remove_old(const std::string& loop);
  std::size_t waiting_before(const Report& report) const;

  QueueSettings settings_;
  ReportCallbacks callbacks_;
  mutable std::mutex mutex_;  // held for copies in memory only
  std::vector<Entry> all_;    // in the order of the requests
  bool is_loaded_ = false;    // all_ contains the reports from before the start
};

}  // namespace loopwarden::daemon::reports
