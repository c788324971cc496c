// SPDX-License-Identifier: Apache-2.0
// What the daemon answers on its status socket, as the rules want it. Names and reasons become one line each.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "services/notify/rules/changes.hpp"
#include "services/notify/rules/watch_rules.hpp"

namespace loopwarden::notify {

inline constexpr const char* kAlarmsRequest = R"({"request":"alarms"})";
inline constexpr const char* kDescribeRequest = R"({"request":"describe"})";
inline constexpr const char* kJournalRequest = R"({"request":"journal","most":200})";

// Throw std::runtime_error if it is no such answer, or "ok" is not true.
std::vector<AlarmReading> alarms_from(std::string_view answer);
std::vector<JournalLine> journal_from(std::string_view answer);
// What the loops are for, by their tags.
std::map<std::string, std::string> descriptions_from(std::string_view answer);

}  // namespace loopwarden::notify
