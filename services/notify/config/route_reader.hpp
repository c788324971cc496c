// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "config/map_reader.hpp"
#include "services/notify/rules/rule_settings.hpp"

namespace loopwarden::notify {

// Reads a time such as "22:30" in minutes; 24:00 ends a day.
int read_time(config::MapReader& in, std::string_view key, const char* meaning);

// `channels`: the names that a route may use.
Route read_route(config::MapReader& in, const std::vector<std::string>& channels);
QuietHours read_quiet_hours(config::MapReader& in, const std::vector<std::string>& channels);

// Returns the zone named at the key. Reports an error if no zone has that name.
const date::time_zone* read_zone(config::MapReader& in, std::string_view key,
                                 const config::Value<std::string>& name);

}  // namespace loopwarden::notify
