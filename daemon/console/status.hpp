// SPDX-License-Identifier: Apache-2.0
// What loops, alarms and windows are in the daemon's answers.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "daemon/console/plant.hpp"
#include "protocol/answers.hpp"

namespace loopwarden::daemon::console {

// One loop's part of `status`.
// Who controls it: here, elsewhere.
const char* control_of(const LoopRuntime& loop);
protocol::LoopStatus loop_status(const Plant& plant, std::size_t loop);
// The ends of a loop's ranges and what its orders must keep to, as in force.
protocol::Ranges ranges_of(const rt::LoopSettings& settings);

protocol::Alarm alarm_of(const std::string& loop, loopwarden::monitor::AlarmKind kind,
                         const monitor::LoopWatch& watch);
protocol::Alarm alarm_of(loopwarden::monitor::BoxAlarm kind,
                         const loopwarden::monitor::BoxAlarms& alarms);
// The loop's newest; nothing: it has had none.
std::optional<protocol::Incident> incident_of(const std::string& loop,
                                              const monitor::LoopWatch& watch);
protocol::Monitor monitor_of(const monitor::LoopWatch& watch, const config::LoopConfig& loop);
protocol::Explanation told(const Explanation& explanation);
// Of this alarm, under its first or its final name.
std::optional<protocol::Explanation> explanation_of(const monitor::LoopWatch& watch,
                                                    loopwarden::monitor::AlarmKind kind);
protocol::JudgedWindow window_of(const monitor::LoggedWindow& window);
protocol::JournalLine line_of(const journal::JournalRow& row);

}  // namespace loopwarden::daemon::console
