// SPDX-License-Identifier: Apache-2.0
// Hours of the day in which a channel is used only for severe events, in a stated time zone. If the
// clocks skip the hour in which a span begins or ends, it begins or ends with the change. If that
// hour occurs twice, the span begins at its first and ends at its second occurrence.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "services/notify/rules/event.hpp"

namespace date {
class time_zone;
}

namespace loopwarden::notify {

struct QuietHours {
  std::vector<std::string> channels;
  const date::time_zone* zone = nullptr;
  int from_min = 0;  // of the local day
  int to_min = 0;    // as from_min or before it: on the next day; 1440: midnight
  std::array<bool, 7> begins_on{true, true, true, true, true, true, true};  // Monday first
  // Events from this severity on are sent all the same.
  std::optional<double> override_severity_percent;
  std::vector<std::string> override_alarms;
};

// Returns the zone of that name in the system's database; null if there is no such zone.
const date::time_zone* find_zone(const std::string& name);

// Returns the end, in UTC ms, of the span that contains `now_ms`; nullopt outside every span.
std::optional<std::int64_t> quiet_until(const QuietHours& hours, std::int64_t now_ms);

// Returns the UTC ms of the newest such minute of the local day, now included.
std::int64_t newest_time_of_day(const date::time_zone& zone, int minute, std::int64_t now_ms);

// Returns the quiet hours of the channel that apply now.
std::vector<const QuietHours*> quiet_now(const std::vector<QuietHours>& all,
                                         const std::string& channel, std::int64_t now_ms);
// Returns whether the event must wait for the end of these hours.
bool held(const std::vector<const QuietHours*>& on, const Event& event);

}  // namespace loopwarden::notify
