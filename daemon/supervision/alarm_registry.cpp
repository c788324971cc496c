// SPDX-License-Identifier: Apache-2.0
#include "daemon/supervision/alarm_registry.hpp"

#include <utility>

namespace loopwarden::daemon::supervision {

AlarmRegistry::AlarmRegistry(std::vector<SupervisedLoop> loops,
                             const alarm::AlarmSettings& settings, journal::Journal& journal,
                             std::function<std::int64_t()> utc_ms)
    : utc_ms_(std::move(utc_ms)) {
  for (SupervisedLoop& loop : loops) {
    loops_.emplace_back(loops_.size(), std::move(loop), settings, journal, utc_ms_);
  }
}

void AlarmRegistry::restore(const journal::AlarmStates& states) {
  for (LoopSupervisor& loop : loops_) loop.alarms().restore(states);
}

std::uint64_t AlarmRegistry::changes() const {
  std::uint64_t all = 0;
  for (const LoopSupervisor& loop : loops_) all += loop.alarms().changes();
  return all;
}

Acknowledged AlarmRegistry::acknowledge_all(std::span<const alarm::AlarmKind> kinds,
                                            const std::string& peer, const std::string& reason) {
  Acknowledged done;
  for (std::size_t i = 0; i < loops_.size(); ++i) {
    JournaledAlarms::AlarmKinds acknowledged;
    const std::uint64_t ticket = of(i).acknowledge(kinds, peer, reason, acknowledged);
    if (!acknowledged.empty()) done.ticket = ticket;
    for (const alarm::AlarmKind kind : acknowledged) done.alarms.push_back({i, kind});
  }
  return done;
}

}  // namespace loopwarden::daemon::supervision
