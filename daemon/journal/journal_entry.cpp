// SPDX-License-Identifier: Apache-2.0
#include "daemon/journal/journal_entry.hpp"

namespace loopwarden::daemon::journal {

void AlarmStates::take(const JournalEntry& line) {
  if (line.memory) memories[{line.loop, line.alarm}] = *line.memory;
  if (line.incident) incidents[line.loop] = *line.incident;
  if (line.memory || line.incident) ++revision;
}

void AlarmStates::take(const AlarmStates& newer) {
  for (const auto& [key, memory] : newer.memories) memories[key] = memory;
  for (const auto& [loop, incident] : newer.incidents) incidents[loop] = incident;
  revision += newer.revision;
}

}  // namespace loopwarden::daemon::journal
