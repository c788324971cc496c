// SPDX-License-Identifier: Apache-2.0
// Compares the alarm rate of a group with the figures of ISA-18.2 for one operator.
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

// Limits: mean per 10 minutes, start of a flood per 10 minutes, share of the time in floods.
inline constexpr double kAcceptable = 1.0;
inline constexpr double kMostManageable = 2.0;
inline constexpr std::int64_t kFlood = 10;  // more than this in 10 minutes
inline constexpr double kMostFlood_percent = 1.0;

// Number of alarms that a group has raised in a bin of 10 minutes. bin: number of the bin.
struct RaisedRow {
  std::string group;
  std::int64_t bin = 0;
  std::int64_t raised = 0;
};

struct RateOfSpan {
  std::int64_t raised = 0;
  double per_bin = 0.0;  // mean per 10 minutes
  std::int64_t most = 0;
  double flood_percent = 0.0;  // of the time
};

struct AlarmRate {
  RateOfSpan day;
  RateOfSpan week;
  std::array<std::int64_t, kBinsOfDay> bins{};  // of the last day, newest last
};

// Returns the rates of the week before the bin `until`, by group. The entry "" is for all groups
// together. A group without a row has no entry.
std::map<std::string, AlarmRate> alarm_rates(const std::vector<RaisedRow>& rows,
                                             std::int64_t until);

}  // namespace loopwarden::fleet
