// SPDX-License-Identifier: Apache-2.0
// How many alarms a group raises, against the figures of ISA-18.2 for one operator.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace loopwarden::fleet {

inline constexpr std::int64_t kBin_s = 600;
inline constexpr std::int64_t kBinsOfDay = 144;
inline constexpr std::int64_t kBinsOfWeek = 7 * kBinsOfDay;

// On average in 10 minutes; in a flood; share of the time in floods.
inline constexpr double kAcceptable = 1.0;
inline constexpr double kMostManageable = 2.0;
inline constexpr std::int64_t kFlood = 10;  // more than that in 10 minutes
inline constexpr double kMostFlood_percent = 1.0;

// Alarms that a group has raised within 10 minutes; bin: their number.
struct RaisedRow {
  std::string group;
  std::int64_t bin = 0;
  std::int64_t raised = 0;
};

struct RateOfSpan {
  std::int64_t raised = 0;
  double per_bin = 0.0;  // mean, in 10 minutes
  std::int64_t most = 0;
  double flood_percent = 0.0;  // of the time
};

struct AlarmRate {
  RateOfSpan day;
  RateOfSpan week;
  std::array<std::int64_t, kBinsOfDay> bins{};  // of the day, the newest last
};

// Of the week before the bin `until`. By group; of all together under "". A group without a row is not in it.
std::map<std::string, AlarmRate> alarm_rates(const std::vector<RaisedRow>& rows,
                                             std::int64_t until);

}  // namespace loopwarden::fleet
