// SPDX-License-Identifier: Apache-2.0
// Operators' actions on an alarm of a loop or of the box, and their journal lines.
#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <string>

#include "daemon/journal/journal_entry.hpp"
#include "model/alarm/alarm.hpp"

namespace loopwarden::daemon::supervision {

template <class Kind>
struct AlarmCommandOf {
  Kind kind{};
  alarm::AlarmAction action = alarm::AlarmAction::acknowledge;
  std::int64_t shelve_ms = 0;  // for shelve
  std::string peer;            // sender, for the journal
  std::string reason;          // given by the sender; may be empty
};

struct CommandResult {
  bool accepted = false;
  std::string why;           // reason of a refusal
  std::uint64_t ticket = 0;  // of the journal's last line; 0 without a line
};

// Returns why the action does not fit the state of `alarm`.
template <class Kind>
std::string why_refused(const AlarmCommandOf<Kind>& command, const std::string& source,
                        const alarm::Alarm& alarm) {
  if (command.action == alarm::AlarmAction::shelve) {
    return fmt::format("an alarm is shelved for at least a minute, and for {} min at most",
                       alarm.settings().shelve_limit_ms / 60'000);
  }
  return fmt::format("alarm {} of {} is {}: nothing to {}", to_text(command.kind), source,
                     to_text(alarm.state()), to_text(command.action));
}

// Returns the journal line of an action. `memory`: state of the alarm after it.
template <class Kind>
journal::JournalEntry line_of(const AlarmCommandOf<Kind>& command, const std::string& source,
                              const CommandResult& result, const alarm::AlarmMemory& memory,
                              std::int64_t utc_ms) {
  journal::JournalEntry entry;
  entry.kind = journal::JournalEntry::Kind::operator_action;
  entry.utc_ms = utc_ms;
  entry.loop = source;
  entry.alarm = to_text(command.kind);
  entry.peer = command.peer;
  entry.what = to_text(command.action);
  if (command.action == alarm::AlarmAction::shelve) {
    entry.new_value = fmt::format("{} min", command.shelve_ms / 60'000);
  }
  entry.reason = command.reason;
  entry.result = result.accepted ? "done" : "refused: " + result.why;
  entry.memory = memory;
  return entry;
}

// Returns true if a change under a shelf or a suppression must be stored for a restart.
inline bool remembered_otherwise(const alarm::AlarmMemory& was,
                                 const alarm::AlarmMemory& now) noexcept {
  return now.raised != was.raised || now.shelved_until_ms != was.shelved_until_ms;
}

}  // namespace loopwarden::daemon::supervision
