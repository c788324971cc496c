// SPDX-License-Identifier: Apache-2.0
// What the status and the alarms of a loop look like as JSON.
#pragma once

#include <cstdint>
#include <string>

#include <nlohmann/json.hpp>

#include "daemon/console/parts.hpp"

namespace loopwarden::daemon::console {

// One loop's part of `status`.
nlohmann::json loop_status(const Parts& parts, std::size_t loop);
// The ends of a loop's ranges and what its orders must keep to, as in force.
nlohmann::json ranges_json(const rt::LoopSettings& settings);

const char* form_text(std::uint8_t jacket_form);
nlohmann::json alarm_json(const std::string& loop, loopwarden::monitor::AlarmKind kind,
                          const loopwarden::monitor::Alarm& alarm);
nlohmann::json watch_json(const monitor::LoopWatch& watch);
nlohmann::json explanation_json(const Explanation& explanation);
// Of this alarm, under its first or its final name; null: there is none.
nlohmann::json explanation_of(const monitor::LoopWatch& watch, loopwarden::monitor::AlarmKind kind);
nlohmann::json window_json(const monitor::LoggedWindow& window);
nlohmann::json journal_json(const journal::JournalRow& row);

}  // namespace loopwarden::daemon::console
