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

// One line of the journal. Fields that don't apply are empty.
struct JournalEntry {
  enum class Kind : std::uint8_t { alarm, operator_action, register_write, test, system };
  Kind kind = Kind::system;
  std::int64_t utc_ms = 0;
  std::string loop;
  std::string alarm;
  std::string from;  // alarm states
  std::string to;
  std::optional<double> severity_percent;
  std::string peer;  // author: "uid 1000", "192.168.1.5:40312"; empty: the daemon itself
  std::string what;  // the action, or the register's name
  std::string old_value;
  std::string new_value;
  std::string result;  // "done", or the reason for a refusal
  std::string reason;  // in the author's words
  // New stored state of the alarm. It is stored together with the line, or not at all.
  std::optional<alarm::AlarmMemory> memory;
  std::optional<alarm::Incident> incident;  // the same for the loop's incident
};

constexpr const char* to_text(JournalEntry::Kind kind) noexcept {
  switch (kind) {
    case JournalEntry::Kind::alarm: return "alarm";
    case JournalEntry::Kind::operator_action: return "operator";
    case JournalEntry::Kind::register_write: return "register";
    case JournalEntry::Kind::test: return "test";
    case JournalEntry::Kind::system: break;
  }
  return "system";
}

// Sets kind, what, values and result of the line about a test: the explanations with the predicted
// probability of a decision, and the decision with its probability. Empty `decided`: undecided.
void set_test_result(JournalEntry& line, const std::string& explanations, double predicted,
                     const std::string& decided, double probability);

// Stored states of all alarms, by loop and alarm, and of all incidents.
using AlarmKey = std::pair<std::string, std::string>;
struct AlarmStates {
  std::uint64_t revision = 0;  // increases with each change; identifies the newer of two copies
  std::map<AlarmKey, alarm::AlarmMemory> memories;
  std::map<std::string, alarm::Incident> incidents;  // by loop

  bool empty() const noexcept { return memories.empty() && incidents.empty(); }
  // Replace the stored states by those of a line, or by newer states.
  void take(const JournalEntry& line);
  void take(const AlarmStates& newer);
};

}  // namespace loopwarden::daemon::journal
