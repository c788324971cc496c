// SPDX-License-Identifier: Apache-2.0
// Reads `alarms` of a loop's file: the normal state, and limit, delays, priority and texts of each
// alarm.
#pragma once

#include <optional>
#include <utility>

#include "config/loop_config.hpp"
#include "config/map_reader.hpp"

namespace loopwarden::config {

struct AlarmsContext {
  Value<std::pair<double, double>> pv_range;
  bool watched = false;
  bool knows_set_point = true;
  bool has_enable = false;
};

// `in` is empty if the file has no `alarms`.
LoopAlarmConfig read_loop_alarms(std::optional<MapReader> in, const AlarmsContext& context);

}  // namespace loopwarden::config
