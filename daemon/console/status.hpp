// SPDX-License-Identifier: Apache-2.0
// Converts loops, alarms and windows to the types of the daemon's answers.
#pragma once

#include <optional>
#include <string>

#include "daemon/console/plant.hpp"
#include "daemon/protocol/answers.hpp"

namespace loopwarden::daemon::console {

// Returns "here" or "elsewhere".
const char* control_of(const LoopRuntime& loop);
// Returns the part of `status` for one loop.
protocol::LoopStatus loop_status(const Plant& plant, std::size_t loop);
// Returns the ranges of a loop and the limits for its commands, as in force.
protocol::Ranges ranges_of(const rt::LoopSettings& settings);

protocol::Alarm alarm_of(const std::string& loop, alarm::AlarmKind kind,
                         const supervision::AlarmSnapshot& watch);
protocol::Alarm alarm_of(alarm::BoxAlarm kind, const host::HostAlarms& all);
// Returns the newest incident of the loop, if it has had one.
std::optional<protocol::Incident> incident_of(const std::string& loop,
                                              const supervision::AlarmSnapshot& watch);
protocol::Monitor monitor_of(const supervision::AlarmSnapshot& watch,
                             const config::LoopConfig& loop);
protocol::Explanation told(const Explanation& explanation);
// Returns the explanation of this alarm, by its first or its final name.
std::optional<protocol::Explanation> explanation_of(const supervision::AlarmSnapshot& watch,
                                                    alarm::AlarmKind kind);
protocol::JudgedWindow window_of(const supervision::LoggedWindow& window);
protocol::JournalLine line_of(const journal::JournalRow& row);

}  // namespace loopwarden::daemon::console
