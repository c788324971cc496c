// SPDX-License-Identifier: Apache-2.0
// Parses times as historians and spreadsheets write them.
//
//   seconds, minutes, hours  numbers, counted from any start; also milliseconds to nanoseconds
//   epoch_s, _ms, _us, _ns   numbers since 1970-01-01 UTC
//   excel                    days since 1899-12-30, with a fraction
//   ymd                      2026-03-01T10:00:00.5+01:00 and similar forms (ISO 8601 and its
//                            relatives; also 20260301T100000Z)
//   dmy, mdy                 01.03.2026 10:00, 3/1/26 10:00:00 AM, 01-Mar-2026 10:00 (the same for
//                            both if the month is a name)
//                            Tue Nov 24 13:05:22 CET 2026, Nov 24, 2026 1:05:22 PM: for all three
//   clock                    10:00:00 without a date: a column of times next to one of dates
//
// Limits: it does not know rare names of time zones, week and ordinal dates, or leap seconds
// (23:59:60 is the second after 23:59:59).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace loopwarden::record {

enum class TimeForm : std::uint8_t {
  automatic,
  seconds,
  milliseconds,
  microseconds,
  nanoseconds,
  minutes,
  hours,
  epoch_s,
  epoch_ms,
  epoch_us,
  epoch_ns,
  excel,
  ymd,
  dmy,
  mdy,
  clock
};
const char* to_text(TimeForm form) noexcept;
std::optional<TimeForm> time_form(std::string_view name) noexcept;
// Returns whether a time is a date, not only a duration since some start.
bool is_absolute(TimeForm form) noexcept;
bool is_date(TimeForm form) noexcept;  // ymd, dmy, mdy

// Whole seconds and fraction are separate, so that a difference of two keeps its nanoseconds.
struct TimePoint {
  std::int64_t whole_s = 0;
  double rest_s = 0.0;  // 0 to 1
  bool zone_known = false;

  double since(const TimePoint& first) const noexcept {
    return static_cast<double>(whole_s - first.whole_s) + (rest_s - first.rest_s);
  }
};

// Returns nullopt if `text` is no time of this form. `decimal` applies to numbers; the seconds of a
// date accept both marks.
std::optional<TimePoint> parse_time(std::string_view text, TimeForm form, char decimal = '.');

// Possible orders of a date with numbers for day and month: both, if neither is above 12.
struct DateOrder {
  bool dmy = false;
  bool mdy = false;
};
DateOrder possible_orders(std::string_view text);

// Returns "2026-03-01T10:00:00Z", without the Z if the zone is unknown, with milliseconds if they
// are not 0.
std::string iso_text(std::int64_t whole_s, double rest_s, bool utc);
// Returns the offset of a zone such as +01:00, Z or UTC, s.
std::optional<int> zone_offset_s(std::string_view text) noexcept;

}  // namespace loopwarden::record
