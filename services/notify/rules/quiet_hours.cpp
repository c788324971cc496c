// SPDX-License-Identifier: Apache-2.0
#include "services/notify/rules/quiet_hours.hpp"

#include <date/tz.h>

#include <algorithm>
#include <chrono>
#include <exception>

namespace loopwarden::notify {
namespace {

using date::choose;
using date::days;
using date::local_days;
using std::chrono::milliseconds;
using std::chrono::minutes;

std::int64_t utc_ms(const date::time_zone& zone, local_days day, int minute, choose which) {
  const auto at = zone.to_sys(day + minutes(minute), which);
  return std::chrono::duration_cast<milliseconds>(at.time_since_epoch()).count();
}

bool contains(const std::vector<std::string>& words, const std::string& word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

}  // namespace

const date::time_zone* find_zone(const std::string& name) {
  try {
    return date::locate_zone(name);
  } catch (const std::exception&) {
    return nullptr;
  }
}

std::optional<std::int64_t> quiet_until(const QuietHours& hours, std::int64_t now_ms) {
  const date::sys_time<milliseconds> now{milliseconds(now_ms)};
  const local_days today = date::floor<days>(hours.zone->to_local(now));
  const int over_midnight = hours.to_min <= hours.from_min ? 1 : 0;
  // Hours that began yesterday may last until today. A change of the clocks moves no end by a day.
  for (const int back : {1, 0}) {
    const local_days day = today - days(back);
    const unsigned weekday = date::weekday(day).iso_encoding() - 1;
    if (!hours.begins_on.at(weekday)) continue;
    const std::int64_t from = utc_ms(*hours.zone, day, hours.from_min, choose::earliest);
    const std::int64_t to =
        utc_ms(*hours.zone, day + days(over_midnight), hours.to_min, choose::latest);
    if (from <= now_ms && now_ms < to) return to;
  }
  return std::nullopt;
}

std::int64_t newest_time_of_day(const date::time_zone& zone, int minute, std::int64_t now_ms) {
  const date::sys_time<milliseconds> now{milliseconds(now_ms)};
  const local_days today = date::floor<days>(zone.to_local(now));
  const std::int64_t at = utc_ms(zone, today, minute, choose::earliest);
  return at <= now_ms ? at : utc_ms(zone, today - days(1), minute, choose::earliest);
}

std::vector<const QuietHours*> quiet_now(const std::vector<QuietHours>& all,
                                         const std::string& channel, std::int64_t now_ms) {
  std::vector<const QuietHours*> on;
  for (const QuietHours& hours : all) {
    if (contains(hours.channels, channel) && quiet_until(hours, now_ms)) on.push_back(&hours);
  }
  return on;
}

bool held(const std::vector<const QuietHours*>& on, const Event& event) {
  return std::any_of(on.begin(), on.end(), [&](const QuietHours* hours) {
    const bool severe = hours->override_severity_percent && event.worst_percent &&
                        *event.worst_percent >= *hours->override_severity_percent;
    return !severe && !contains(hours->override_alarms, event.alarm);
  });
}

}  // namespace loopwarden::notify
