// SPDX-License-Identifier: Apache-2.0
#include "daemon/journal/journal_entry.hpp"

#include <fmt/format.h>

namespace loopwarden::daemon::journal {

void set_test_result(JournalEntry& line, const std::string& explanations, double predicted,
                     const std::string& decided, double probability) {
  line.kind = JournalEntry::Kind::test;
  line.what = "test result";
  line.old_value = fmt::format("{}: {:.3f}", explanations, predicted);
  line.new_value = decided.empty() ? "undecided" : fmt::format("{}: {:.3f}", decided, probability);
  line.result = "done";
}

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
