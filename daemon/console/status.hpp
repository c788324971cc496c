// SPDX-License-Identifier: Apache-2.0
// What loops, alarms and windows are in the daemon's answers.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "daemon/console/parts.hpp"
#include "daemon/protocol/answers.hpp"

namespace loopwarden::daemon::console {

// One loop's part of `status`.
// Who controls it: here, elsewhere.
const char* control_of(const LoopRuntime& loop);
protocol::LoopStatus loop_status(const Parts& parts, std::size_t loop);
// The ends of a loop's ranges and what its orders must keep to, as in force.
protocol::Ranges ranges_of(const rt::LoopSettings& settings);

protocol::Alarm alarm_of(const std::string& loop, alarm::AlarmKind kind,
                         const supervision::LoopWatch& watch);
protocol::Alarm alarm_of(alarm::BoxAlarm kind, const alarm::BoxAlarms& alarms);
// The loop's newest; nothing: it has had none.
std::optional<protocol::Incident> incident_of(const std::string& loop,
                                              const supervision::LoopWatch& watch);
protocol::Monitor monitor_of(const supervision::LoopWatch& watch, const config::LoopConfig& loop);
protocol::Explanation told(const Explanation& explanation);
// Of this alarm, under its first or its final name.
std::optional<protocol::Explanation> explanation_of(const supervision::LoopWatch& watch,
                                                    alarm::AlarmKind kind);
protocol::JudgedWindow window_of(const supervision::LoggedWindow& window);
protocol::JournalLine line_of(const journal::JournalRow& row);

}  // namespace loopwarden::daemon::console
