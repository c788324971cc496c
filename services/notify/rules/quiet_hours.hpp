// SPDX-License-Identifier: Apache-2.0
// Hours of the day in which a channel is not to be used but for what is severe. The hours are those of a stated time
// zone: where its clocks are put forward or back, a span that begins or ends in the hour that is missing begins or ends
// with the change, and one in the hour that comes twice begins the first and ends the second time.
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
  std::optional<double> override_severity_percent;  // from that on an event is sent all the same
  std::vector<std::string> override_alarms;
};

// The zone of that name in the system's database; nullopt if there is none.
const date::time_zone* find_zone(const std::string& name);

// UTC ms at which the span that `now_ms` is in ends; nullopt if it is in none.
std::optional<std::int64_t> quiet_until(const QuietHours& hours, std::int64_t now_ms);

// UTC ms of the newest such minute of the local day, now included.
std::int64_t newest_time_of_day(const date::time_zone& zone, int minute, std::int64_t now_ms);

// Those of the channel that are on now.
std::vector<const QuietHours*> quiet_now(const std::vector<QuietHours>& all,
                                         const std::string& channel, std::int64_t now_ms);
// Is the event to wait for the end of these?
bool held(const std::vector<const QuietHours*>& on, const Event& event);

}  // namespace loopwarden::notify
