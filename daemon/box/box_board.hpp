// SPDX-License-Identifier: Apache-2.0
// The box's own alarms as they are now, and what operators do with them. Every change goes to the journal. Any thread.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <utility>

#include "daemon/journal/journal.hpp"
#include "daemon/monitor/watch_board.hpp"
#include "model/monitor/box_alarms.hpp"

namespace loopwarden::daemon::box {

// What one look at the box found, each with its reason in words.
struct BoxReport {
  loopwarden::monitor::BoxFindings found{};
  std::array<std::string, loopwarden::monitor::kBoxAlarmCount> why{};
};

struct BoxOrder {
  loopwarden::monitor::BoxAlarm kind = loopwarden::monitor::BoxAlarm::disk_full;
  loopwarden::monitor::AlarmAction action = loopwarden::monitor::AlarmAction::acknowledge;
  std::int64_t shelve_ms = 0;  // for shelve
  std::string peer;            // who, for the journal
  std::string reason;          // his words; may be empty
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

  monitor::OrderResult act(const BoxOrder& order);
  // Every one that waits; the ticket of the journal's last line.
  std::uint64_t acknowledge_all(const std::string& peer, const std::string& reason);

  loopwarden::monitor::BoxAlarms alarms() const;
  // Why the condition of this alarm is on, by the newest look; empty: it is not.
  std::string why(loopwarden::monitor::BoxAlarm kind) const;

 private:
  using States = std::array<loopwarden::monitor::AlarmState, loopwarden::monitor::kBoxAlarmCount>;
  States states() const;
  std::uint64_t write_changes(const States& before);
  monitor::OrderResult act_locked(const BoxOrder& order);

  journal::Journal& journal_;
  std::function<std::int64_t()> utc_ms_;
  mutable std::mutex mutex_;
  loopwarden::monitor::BoxAlarms alarms_;
  BoxReport newest_;
};

}  // namespace loopwarden::daemon::box
