// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "daemon/supervision/loop_supervisor.hpp"

namespace loopwarden::daemon::supervision {

// Alarms that were acknowledged together.
struct Acknowledged {
  struct Which {
    std::size_t loop = 0;
    alarm::AlarmKind kind = alarm::AlarmKind::stiction;
  };
  std::vector<Which> alarms;
  std::uint64_t ticket = 0;  // of the journal's last line; 0: no alarm was unacknowledged
};

// All supervised loops by index: snapshots for readers, and actions for operators. Any thread.
class AlarmRegistry {
 public:
  // `utc_ms` returns the present time, ms since 1970.
  AlarmRegistry(std::vector<SupervisedLoop> loops, const alarm::AlarmSettings& settings,
                journal::Journal& journal, std::function<std::int64_t()> utc_ms);
  AlarmRegistry(const AlarmRegistry&) = delete;
  AlarmRegistry& operator=(const AlarmRegistry&) = delete;

  LoopSupervisor& supervisor(std::size_t loop) { return loops_[loop]; }
  const LoopSupervisor& supervisor(std::size_t loop) const { return loops_[loop]; }
  JournaledAlarms& of(std::size_t loop) { return loops_[loop].alarms(); }
  const JournaledAlarms& of(std::size_t loop) const { return loops_[loop].alarms(); }

  // Restores the state before a restart. Call before the threads start.
  void restore(const journal::AlarmStates& states);

  AlarmSnapshot snapshot(std::size_t loop) const { return of(loop).snapshot(); }
  // Passes the state to `look` without a copy. `look` must be quick, because the monitor waits.
  template <class Look>
  void look(std::size_t loop, Look look) const {
    of(loop).look(look);
  }
  // Number of changes of any alarm since the start: a reader of the list reads again after a
  // change.
  std::uint64_t changes() const;
  std::size_t loops() const noexcept { return loops_.size(); }
  const std::string& name(std::size_t loop) const { return of(loop).name(); }
  std::int64_t now_ms() const { return utc_ms_(); }

  CommandResult act(std::size_t loop, const AlarmCommand& command) { return of(loop).act(command); }
  // Acknowledges all unacknowledged alarms of `kinds`, in all loops.
  Acknowledged acknowledge_all(std::span<const alarm::AlarmKind> kinds, const std::string& peer,
                               const std::string& reason);

 private:
  std::function<std::int64_t()> utc_ms_;
  std::deque<LoopSupervisor> loops_;
};

}  // namespace loopwarden::daemon::supervision
