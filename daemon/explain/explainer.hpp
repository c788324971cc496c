// SPDX-License-Identifier: Apache-2.0
// Explains alarms one at a time in the folder of the alarm's evidence. Each explanation runs in a
// child process of idle priority (`loopwarden explain --background`).
//
// An explanation waits until its minutes are complete (`wait`). The explainer then writes
// minutes.csv and starts the child. The child limits its own memory and processor time. It is
// killed after `most_time`. post() never waits.
//
// All alarms of a loop in one incident share one explanation. It is repeated when more has been
// seen (`repeat`). First explanations precede repeats. A full queue drops its newest repeat,
// otherwise the newest job, and reports it. A dropped repeat leaves the previous explanation. A
// dropped first one leaves the alarm without explanation. While no explanation is due, the thread
// does other work (`spare`), which yields when one becomes due.
//
// The slip of a watched loop waits for a move of another controller. A search runs
// `loopwarden valve-test --record` as a child, which finds the move in the recorder's segments and
// judges it. Its results are in the folder `test` of the evidence.
//
// Minutes are in memory. While an explanation waits, its minutes are saved once a minute and at the
// end of the daemon, together with pending.json (pending_explanation.hpp). After a restart the
// explanation continues with the saved minutes. If they are too few for a result and the alarm is
// still on, it waits for as many minutes after the restart (`again`).
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <list>
#include <mutex>
#include <optional>
#include <string>

#include "daemon/supervision/explanation.hpp"
#include "daemon/supervision/history.hpp"
#include "base/thread.hpp"

namespace loopwarden::daemon {

struct ExplainJob {
  std::size_t loop = 0;
  alarm::AlarmKind alarm = alarm::AlarmKind::stiction;
  std::uint64_t raised_at = 0;   // in cycles of the loop
  std::int64_t raised_ms = 0;    // UTC, ms since 1970
  std::int64_t incident_ms = 0;  // opening of the incident
  std::filesystem::path folder;  // folder of the evidence
  std::chrono::milliseconds wait{0};
  double enough_s = 0.0;  // time of the loop after the alarm that the explanation needs
  // Set for a job from before a restart: its minutes are on the disk, and this many s of them are
  // after the alarm.
  std::optional<double> resumed_s{};
  std::chrono::milliseconds again{0};
  bool renewed = false;  // uses the minutes after the restart
  // Time of the loop since the change that has been seen when the job is due, s, and the cycle of
  // the change.
  double seen_s = 0.0;
  std::int64_t changed_at = 0;
  // Repeats the explanation of an alarm over more minutes. The repeat is dropped if `wanted`
  // returns false when it is due. Its minutes are not saved for a restart.
  bool repeat = false;
  std::function<bool()> wanted{};
  // A search for the move of the slip in this folder of segments, in place of an explanation. It is
  // a repeat. The queue has room for one search per loop, and a new one replaces it.
  std::filesystem::path segments{};
  std::string trouble{};  // why the search before failed; empty: it did not
  bool is_search() const noexcept { return !segments.empty(); }
};

// For other work: waits up to the given time and returns true if the work must stop.
using StopWork = std::function<bool(std::chrono::milliseconds)>;

struct ExplainerSettings {
  std::filesystem::path program;  // path of loopwarden; empty: not found, so no alarm is explained
  std::size_t most_waiting = 16;  // in addition to the one at work
  std::chrono::seconds most_time{3600};    // per explanation; enough for a host without idle time
  std::chrono::milliseconds save{60'000};  // between saves of waiting minutes
  std::function<bool(const StopWork& stop)> spare{};  // returns false if no work is left
};

struct ExplainerStatus {
  std::uint64_t explained = 0;  // since the start
  std::uint64_t failed = 0;
  std::uint64_t waiting = 0;  // includes the one at work
};

class Explainer {
 public:
  using Minutes = std::function<supervision::History::Minutes(std::size_t loop)>;
  // Called by the explainer's thread with the explanation, or with the reason for a failure
  // (`explanation` is then null).
  using Report = std::function<void(const ExplainJob& job, const Explanation* explanation,
                                    const std::string& why)>;
  Explainer(ExplainerSettings settings, Minutes minutes, Report report);
  Explainer(const Explainer&) = delete;
  Explainer& operator=(const Explainer&) = delete;
  ~Explainer() { stop(); }

  void start();
  // Kills the child and drops the waiting jobs.
  void stop();
  // Does the same as stop(), for at most `patience`. Returns false if the disk hangs.
  bool stop_for(std::chrono::milliseconds patience);

  // From any thread except the real-time one.
  void post(ExplainJob job);
  // Announces work for `spare`.
  void wake();
  ExplainerStatus status() const;

 private:
  struct Waiting {
    ExplainJob job;
    std::chrono::steady_clock::time_point due;
    std::chrono::steady_clock::time_point save;  // time of the next save
    bool at_work = false;
  };
  using Item = std::list<Waiting>::iterator;
  // Number of waiting explanations.
  std::size_t explanations() const;
  // Makes room in the queue. A full queue drops a repeat in favour of a first explanation. Returns
  // false without room.
  bool make_room(const ExplainJob& job);
  void run();
  Item next_to_explain();
  bool is_due() const;
  // Saves the minutes of one job whose save is due. Returns false if no save is due.
  bool save_one(std::unique_lock<std::mutex>& lock);
  // Returns false if there was no work to do.
  bool work_between(std::unique_lock<std::mutex>& lock);
  // Returns the job to save next. Jobs from before a restart are not saved.
  Item next_to_save();
  // Saves the minutes. If the loop was in manual meanwhile, its history has restarted; the earlier
  // saved minutes are then kept.
  void save(const ExplainJob& job) noexcept;
  // Returns false if the job must wait for other minutes.
  bool explain(const ExplainJob& job);
  // Returns why the child failed; empty: it succeeded.
  std::string run_child(const ExplainJob& job);

  ExplainerSettings settings_;
  Minutes minutes_;
  Report report_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::list<Waiting> queue_;
  ExplainerStatus status_;
  bool quit_ = false;
  bool woken_ = false;
  base::Thread thread_;
};

// Returns the path of `loopwarden`: in this program's folder or in ../bin; empty if not found.
std::filesystem::path workbench_program();

}  // namespace loopwarden::daemon
