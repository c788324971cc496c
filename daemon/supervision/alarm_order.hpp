// SPDX-License-Identifier: Apache-2.0
// What operators want of an alarm, of a loop or of the box, and what the journal says of it.
#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <string>

#include "daemon/journal/journal_entry.hpp"
#include "model/alarm/alarm.hpp"

namespace loopwarden::daemon::supervision {

template <class Kind>
struct OrderOf {
  Kind kind{};
  alarm::AlarmAction action = alarm::AlarmAction::acknowledge;
  std::int64_t shelve_ms = 0;  // for shelve
  std::string peer;            // who, for the journal
  std::string reason;          // his words; may be empty
};

struct OrderResult {
  bool accepted = false;
  std::string why;           // not accepted, in words
  std::uint64_t ticket = 0;  // accepted: of the journal's last line; 0: there is none
};

// Not accepted, because the alarm was as it is in `alarm`.
template <class Kind>
std::string why_refused(const OrderOf<Kind>& order, const std::string& source,
                        const alarm::Alarm& alarm) {
  if (order.action == alarm::AlarmAction::shelve) {
    return fmt::format("an alarm is shelved for at least a minute, and for {} min at most",
                       alarm.settings().shelve_limit_ms / 60'000);
  }
  return fmt::format("alarm {} of {} is {}: nothing to {}", to_text(order.kind), source,
                     to_text(alarm.state()), to_text(order.action));
}

// `memory`: as the alarm is after the order.
template <class Kind>
journal::JournalEntry line_of(const OrderOf<Kind>& order, const std::string& source,
                              const OrderResult& result, const alarm::AlarmMemory& memory,
                              std::int64_t utc_ms) {
  journal::JournalEntry entry;
  entry.kind = journal::JournalEntry::Kind::operator_action;
  entry.utc_ms = utc_ms;
  entry.loop = source;
  entry.alarm = to_text(order.kind);
  entry.peer = order.peer;
  entry.what = to_text(order.action);
  if (order.action == alarm::AlarmAction::shelve) {
    entry.new_value = fmt::format("{} min", order.shelve_ms / 60'000);
  }
  entry.reason = order.reason;
  entry.result = result.accepted ? "done" : "refused: " + result.why;
  entry.memory = memory;
  return entry;
}

// What changes under a shelf or a suppression must be remembered, too.
inline bool remembered_otherwise(const alarm::AlarmMemory& was,
                                 const alarm::AlarmMemory& now) noexcept {
  return now.raised != was.raised || now.shelved_until_ms != was.shelved_until_ms;
}

}  // namespace loopwarden::daemon::supervision
