// SPDX-License-Identifier: Apache-2.0
// The performance of an alarm system in the figures of ISA-18.2.
//
//   rate        alarms raised per hour; the most within one interval of 10 min
//   flood       from an interval of 10 min with more than kFloodBegins alarms to one with fewer
//               than kFloodEnds
//   chattering  an alarm that is raised kChatters times or more within a minute
//   top         the most frequent alarms, with their share of all
//
// Times are in ms since 1970 (UTC). Intervals begin at multiples of 10 min of the clock. Alarms
// before `from_ms` or after `to_ms` are ignored.
//
// No errors.
// Limits: it can't report which operator's console had an alarm. The targets apply to a console,
// and a box has one.
//
// Source: ANSI/ISA-18.2-2016 (IEC 62682), monitoring and assessment. About 6 alarms per hour and
// 1 in 10 min are manageable. 10 in 10 min are a flood; floods should take less than 1 % of the
// time. The ten most frequent alarms should be less than 5 % of all. No alarm should chatter, and
// fewer than five should be stale (on for more than a day).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace loopwarden::alarm {

struct AlarmCame {
  std::int64_t utc_ms = 0;
  std::string source{};  // the loop's tag, or another owner of the alarm
  std::string alarm{};
};

struct CountedAlarm {
  std::string source{};
  std::string alarm{};
  std::size_t count = 0;
  double percent = 0.0;  // share of all raised alarms

  friend bool operator==(const CountedAlarm&, const CountedAlarm&) = default;
};

struct AlarmFigures {
  std::size_t came = 0;
  double per_hour = 0.0;
  std::size_t most_in_stretch = 0;
  std::size_t floods = 0;
  double flood_percent = 0.0;            // of the time
  std::vector<CountedAlarm> top;         // the most frequent first
  std::vector<CountedAlarm> chattering;  // count: the most within a minute
};

// Returns the figures of `came`, which may be in any order.
AlarmFigures figures_of(std::span<const AlarmCame> came, std::int64_t from_ms, std::int64_t to_ms);

}  // namespace loopwarden::alarm
