// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "model/alarm/alarm.hpp"
#include "model/alarm/loop_incident.hpp"

namespace loopwarden::daemon::journal {

// One line of the journal. What does not apply stays empty.
struct JournalEntry {
  enum class Kind : std::uint8_t { alarm, operator_action, register_write, system };
  Kind kind = Kind::system;
  std::int64_t utc_ms = 0;
  std::string loop;
  std::string alarm;
  std::string from;  // alarm states
  std::string to;
  std::optional<double> severity_percent;
  std::string peer;  // who: "uid 1000", "192.168.1.5:40312"; empty: the daemon itself
  std::string what;  // the action, or the register's name
  std::string old_value;
  std::string new_value;
  std::string result;  // "done", or why not
  std::string reason;  // in the words of who did it
  // What the alarm must remember from here on; stored together with the line, or not at all.
  std::optional<alarm::AlarmMemory> memory;
  std::optional<alarm::Incident> incident;  // the same of the loop's incident
};

constexpr const char* to_text(JournalEntry::Kind kind) noexcept {
  switch (kind) {
    case JournalEntry::Kind::alarm: return "alarm";
    case JournalEntry::Kind::operator_action: return "operator";
    case JournalEntry::Kind::register_write: return "register";
    case JournalEntry::Kind::system: break;
  }
  return "system";
}

// What all alarms and incidents remember; of alarms by loop and alarm.
using AlarmKey = std::pair<std::string, std::string>;
struct AlarmStates {
  std::uint64_t revision = 0;  // +1 with each change; tells the newer of two copies
  std::map<AlarmKey, alarm::AlarmMemory> memories;
  std::map<std::string, alarm::Incident> incidents;  // by loop

  bool empty() const noexcept { return memories.empty() && incidents.empty(); }
  // Puts what the line remembers, or what newer states do, in place of what is here.
  void take(const JournalEntry& line);
  void take(const AlarmStates& newer);
};

}  // namespace loopwarden::daemon::journal
