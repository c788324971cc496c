// SPDX-License-Identifier: Apache-2.0
// Asks the daemon once a second on its own thread, so that a daemon that hangs delays only this
// thread. Reconnects automatically.
#pragma once

#include <chrono>
#include <condition_variable>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "services/notify/rules/watch_rules.hpp"
#include "services/notify/subscription/answers.hpp"
#include "daemon/protocol/daemon_client.hpp"
#include "base/thread.hpp"

namespace loopwarden::notify {

struct Snapshot {
  std::vector<AlarmReading> alarms;
  std::vector<JournalLine> journal;  // only if an alarm has changed since the last snapshot
};

// Replaces `older`, which was not taken, by `newer`. The newest thousand of its reasons are kept.
void keep_reasons(Snapshot& newer, Snapshot older);

class Watcher {
 public:
  explicit Watcher(std::string socket) : daemon_(std::move(socket), kPatience) {}
  Watcher(const Watcher&) = delete;
  Watcher& operator=(const Watcher&) = delete;
  ~Watcher() { stop_for(std::chrono::milliseconds(0)); }

  void start();
  // Returns false if the thread still hangs in a call.
  bool stop_for(std::chrono::milliseconds patience);

  // Returns the newest answer, once.
  std::optional<Snapshot> take();
  // Returns how long the daemon has not answered; 0 from an answer until the next question fails.
  std::chrono::milliseconds silent() const;
  // Returns why it does not answer; empty if it does.
  std::string error() const;

 private:
  void run();
  void ask();
  // Records that the daemon answers, even if it refuses the request.
  template <class Request>
  auto answer_to(const Request& request);
  void describe();
  void explain(const std::vector<AlarmReading>& alarms);
  bool changed(const std::vector<AlarmReading>& alarms);

  static constexpr std::chrono::milliseconds kPatience{3000};

  // Used only by the thread.
  protocol::DaemonClient daemon_;
  std::vector<AlarmReading> before_;
  std::map<std::string, LoopWords> loops_;
  struct Explained {
    AlarmWords words;
    std::string incident;  // that they belong to; empty: they belong to one raise
    std::int64_t times_raised = 0;
    bool is_of(const AlarmReading& alarm) const {
      return incident == alarm.incident &&
             (!incident.empty() || times_raised == alarm.times_raised);
    }
  };
  std::map<AlarmKey, Explained> words_;  // of the active alarms

  mutable std::mutex mutex_;
  std::condition_variable wake_;
  bool quit_ = false;
  std::optional<Snapshot> snapshot_;
  std::chrono::steady_clock::time_point answered_ = std::chrono::steady_clock::now();
  std::string error_ = "not asked yet";
  base::Thread thread_;
};

}  // namespace loopwarden::notify
