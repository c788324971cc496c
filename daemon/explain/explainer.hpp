// SPDX-License-Identifier: Apache-2.0
// Has alarms explained: one at a time, by a child process of idle priority (`loopwarden explain --background`), in the
// folder of the alarm's evidence.
//
// An explanation waits until its minutes are there (`wait`), then writes them to minutes.csv and starts the child; the
// child bounds its own memory and processor time, and is killed after `most_time`. Whoever posts never waits.
// The loop's alarms of one incident have one explanation, done again as more has been seen (`repeat`). First ones go before
// repeats. A queue that is full drops its newest repeat, else the newest that came, and says so: a repeat leaves the explanation
// that is there, a first one the alarm without any.
// While none is due, the thread does other work of this kind (`spare`), which makes room for one that comes due.
//
// Minutes live in memory. While an explanation waits, what is there of them is saved once a minute and at the end of the
// daemon, with pending.json beside them (pending_explanation.hpp): after a restart the explanation goes on with that. Where that
// is too short to tell, as many minutes of after the restart are waited for (`again`), as the alarm is on still.
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
  loopwarden::monitor::AlarmKind alarm = loopwarden::monitor::AlarmKind::stiction;
  std::uint64_t raised_at = 0;   // the loop's cycle
  std::int64_t raised_ms = 0;    // UTC, ms since 1970
  std::int64_t incident_ms = 0;  // of the incident, when it opened
  std::filesystem::path folder;  // of the evidence
  std::chrono::milliseconds wait{0};
  double enough_s = 0.0;  // after the alarm, of the loop's time: what is waited for
  // Of before a restart: its minutes are those on the disk, and so much of them is after the alarm, s.
  std::optional<double> resumed_s{};
  std::chrono::milliseconds again{0};
  bool renewed = false;  // its minutes are those of after the restart
  // Of what has changed, of the loop's time: how much has been seen once it is due, and the cycle at which it began.
  double seen_s = 0.0;
  std::int64_t changed_at = 0;
  // One more of an alarm that has an explanation, over more minutes; dropped where `wanted` says no once it is due. Its
  // minutes are not saved for a restart.
  bool repeat = false;
  std::function<bool()> wanted{};
};

// For work between: true after at most the time given where it is to leave off.
using StopWork = std::function<bool(std::chrono::milliseconds)>;

struct ExplainerSettings {
  std::filesystem::path program;           // loopwarden; empty: there is none, nothing is explained
  std::size_t most_waiting = 16;           // beside the one at work
  std::chrono::seconds most_time{3600};    // of one, on a box without a moment to spare
  std::chrono::milliseconds save{60'000};  // between saves of the minutes that wait
  std::function<bool(const StopWork& stop)> spare{};  // false: there is nothing to do
};

struct ExplainerStatus {
  std::uint64_t explained = 0;  // since the start
  std::uint64_t failed = 0;
  std::uint64_t waiting = 0;  // the one at work included
};

class Explainer {
 public:
  using Minutes = std::function<supervision::History::Minutes(std::size_t loop)>;
  // By the explainer's thread, when an explanation is there, or why it is not (`explanation` is null then).
  using Report = std::function<void(const ExplainJob& job, const Explanation* explanation,
                                    const std::string& why)>;
  Explainer(ExplainerSettings settings, Minutes minutes, Report report);
  Explainer(const Explainer&) = delete;
  Explainer& operator=(const Explainer&) = delete;
  ~Explainer() { stop(); }

  void start();
  // Kills the child; what waits is dropped.
  void stop();
  // As stop(), for at most `patience`; false if the disk hangs.
  bool stop_for(std::chrono::milliseconds patience);

  // Any thread but the real-time one.
  void post(ExplainJob job);
  // There is something to do for `spare`.
  void wake();
  ExplainerStatus status() const;

 private:
  struct Waiting {
    ExplainJob job;
    std::chrono::steady_clock::time_point due;
    std::chrono::steady_clock::time_point save;  // the next time
    bool at_work = false;
  };
  using Item = std::list<Waiting>::iterator;
  void ask_to_end();
  // False: there is none. Of a full queue a repeat is dropped for a first one.
  bool make_room(const ExplainJob& job);
  void run();
  Item next_to_explain();
  bool is_due() const;
  // Of the minutes that wait those whose time has come; false: none has.
  bool save_one(std::unique_lock<std::mutex>& lock);
  // False: there was nothing to do.
  bool work_between(std::unique_lock<std::mutex>& lock);
  // The one to save next; none of a job of before a restart.
  Item next_to_save();
  // Where the loop has been in manual since, its history began anew: what was saved before is kept then.
  void save(const ExplainJob& job) noexcept;
  // False where other minutes are to be waited for.
  bool explain(const ExplainJob& job);
  // Why it did not end as it should; empty: it did.
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

// Where `loopwarden` is beside this program, or in ../bin; empty: nowhere.
std::filesystem::path workbench_program();

}  // namespace loopwarden::daemon
