// SPDX-License-Identifier: Apache-2.0
// The present alarms of the box, with the operators' actions on them. Every change is written to
// the journal. Thread-safe.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "daemon/journal/journal.hpp"
#include "daemon/supervision/alarm_command.hpp"
#include "model/alarm/box_alarms.hpp"

namespace loopwarden::daemon::host {

// The conditions found by one check of the box, each with its reason in words.
struct BoxReport {
  alarm::BoxFindings found{};
  std::array<std::string, alarm::kBoxAlarmCount> why{};
  std::vector<std::string> lost_connections{};
  bool output_behind = false;  // of a lost connection: a loop that is controlled here
};

using BoxCommand = supervision::AlarmCommandOf<alarm::BoxAlarm>;

// Alarms that were acknowledged together.
struct BoxAcknowledged {
  std::vector<alarm::BoxAlarm> alarms;
  std::uint64_t ticket = 0;  // of the journal's last line; 0: no alarm was waiting
};

class HostAlarms {
 public:
  HostAlarms(const alarm::AlarmSettings& settings, journal::Journal& journal,
             std::function<std::int64_t()> utc_ms)
      : journal_(journal), utc_ms_(std::move(utc_ms)), alarms_(settings) {}
  HostAlarms(const HostAlarms&) = delete;
  HostAlarms& operator=(const HostAlarms&) = delete;

  // Call it before the threads start.
  void restore(const journal::AlarmStates& states);
  void look(const BoxReport& report, std::int64_t monotonic_ms);

  supervision::CommandResult act(const BoxCommand& order);
  // Acknowledges every waiting alarm.
  BoxAcknowledged acknowledge_all(const std::string& peer, const std::string& reason);

  alarm::BoxAlarms alarms() const;
  alarm::Priority priority(alarm::BoxAlarm kind) const;
  // Returns why the alarm's condition is on, from the newest check; empty: it is off.
  std::string why(alarm::BoxAlarm kind) const;
  // Returns what the alarm named last, while it is shown.
  std::string about(alarm::BoxAlarm kind) const;
  // Number of changes of all alarms since the start.
  std::uint64_t changes() const;

 private:
  // Writes the changed alarms to the journal. Returns the last ticket.
  std::uint64_t write_changes(const alarm::BoxAlarms& before);
  // Raises connection_lost again if a connection is lost in addition to those it was raised for.
  bool raise_for_new_connections();
  supervision::CommandResult act_locked(const BoxCommand& order);

  journal::Journal& journal_;
  std::function<std::int64_t()> utc_ms_;
  mutable std::mutex mutex_;
  alarm::BoxAlarms alarms_;
  BoxReport newest_;
  std::array<std::string, alarm::kBoxAlarmCount> about_;
  std::vector<std::string> raised_for_;  // lost connections that connection_lost was raised for
  std::uint64_t changes_ = 0;
};

}  // namespace loopwarden::daemon::host
