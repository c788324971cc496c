// SPDX-License-Identifier: Apache-2.0
// The box's own alarms as they are now, and what operators do with them. Every change goes to the journal. Any thread.
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
#include "model/monitor/box_alarms.hpp"

namespace loopwarden::daemon::box {

// What one look at the box found, each with its reason in words.
struct BoxReport {
  loopwarden::monitor::BoxFindings found{};
  std::array<std::string, loopwarden::monitor::kBoxAlarmCount> why{};
};

using BoxCommand = supervision::AlarmCommandOf<loopwarden::monitor::BoxAlarm>;

// Alarms that were acknowledged together.
struct BoxAcknowledged {
  std::vector<loopwarden::monitor::BoxAlarm> alarms;
  std::uint64_t ticket = 0;  // of the journal's last line; 0: no alarm waited
};

class BoxBoard {
 public:
  BoxBoard(const loopwarden::monitor::AlarmSettings& settings, journal::Journal& journal,
           std::function<std::int64_t()> utc_ms)
      : journal_(journal), utc_ms_(std::move(utc_ms)), alarms_(settings) {}
  BoxBoard(const BoxBoard&) = delete;
  BoxBoard& operator=(const BoxBoard&) = delete;

  // Before the threads start.
  void restore(const journal::AlarmStates& states);
  void look(const BoxReport& report, std::int64_t monotonic_ms);

  supervision::CommandResult act(const BoxCommand& order);
  // Every one that waits.
  BoxAcknowledged acknowledge_all(const std::string& peer, const std::string& reason);

  loopwarden::monitor::BoxAlarms alarms() const;
  // Why the condition of this alarm is on, by the newest look; empty: it is not.
  std::string why(loopwarden::monitor::BoxAlarm kind) const;
  // How often any of them has changed since the start.
  std::uint64_t changes() const;

 private:
  // Journals what is not as before; returns the last ticket.
  std::uint64_t write_changes(const loopwarden::monitor::BoxAlarms& before);
  supervision::CommandResult act_locked(const BoxCommand& order);

  journal::Journal& journal_;
  std::function<std::int64_t()> utc_ms_;
  mutable std::mutex mutex_;
  loopwarden::monitor::BoxAlarms alarms_;
  BoxReport newest_;
  std::uint64_t changes_ = 0;
};

}  // namespace loopwarden::daemon::box
