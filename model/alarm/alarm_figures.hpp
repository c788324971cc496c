// SPDX-License-Identifier: Apache-2.0
// How an alarm system does, in the figures of ISA-18.2.
//
//   rate        alarms that came, an hour; the most in one stretch of 10 min
//   flood       from a stretch of 10 min with more than kFloodBegins alarms to one with fewer than kFloodEnds
//   chattering  an alarm that came kChatters times or more within a minute
//   top         the alarms that came most often, with their share of all
//
// Times are ms since 1970 (UTC); stretches begin at whole ones of the clock. What came before `from_ms` or after `to_ms`
// is not looked at.
//
// Errors: none.
// What it can't do: say which operator's console had an alarm: the targets are a console's, and a box has one.
//
// Source: ANSI/ISA-18.2-2016 (IEC 62682), monitoring and assessment: about 6 alarms an hour and 1 in 10 min can be
// managed, 10 in 10 min are a flood, which should take less than 1 % of the time; the ten most frequent alarms should be
// less than 5 % of all; no alarm should chatter, and fewer than five be stale (on for more than a day).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace loopwarden::alarm {

inline constexpr std::int64_t kStretch_ms = 600'000;
inline constexpr std::size_t kFloodBegins = 10;
inline constexpr std::size_t kFloodEnds = 5;
inline constexpr std::size_t kChatters = 3;
inline constexpr std::int64_t kChatter_ms = 60'000;
inline constexpr std::int64_t kStale_ms = 24LL * 3'600'000;
inline constexpr std::size_t kTop = 10;

struct AlarmCame {
  std::int64_t utc_ms = 0;
  std::string source{};  // the loop's tag, or what else has it
  std::string alarm{};
};

struct CountedAlarm {
  std::string source{};
  std::string alarm{};
  std::size_t count = 0;
  double percent = 0.0;  // of all that came

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

// In any order.
AlarmFigures figures_of(std::span<const AlarmCame> came, std::int64_t from_ms, std::int64_t to_ms);

}  // namespace loopwarden::alarm
