// SPDX-License-Identifier: Apache-2.0
// The rules: which channels report which events, and when. Times are whole minutes or milliseconds,
// as the names state.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "services/notify/rules/event.hpp"
#include "services/notify/rules/quiet_hours.hpp"

namespace loopwarden::notify {

// One more step while the alarm is unacknowledged: other channels report it, once or repeatedly.
struct Escalation {
  std::int64_t after_min = 0;  // since the alarm was raised
  std::int64_t every_min = 0;  // 0: once
  std::int64_t most = 0;       // repeats
  std::vector<std::string> channels;
};

struct Route {
  std::vector<std::string> loops;   // patterns with * and ?; empty: all
  std::vector<std::string> areas;   // paths, with all their parts; empty: all
  std::vector<std::string> alarms;  // names; empty: all
  std::array<bool, kRoutedChanges> changes{};
  double min_severity_percent = 0.0;  // alarms without a size pass
  std::vector<std::string> channels;
  std::vector<Escalation> reminders;  // the route's own repeats, and its steps
  bool logs_only = false;             // no channel of the route is for people
};

struct ChannelRule {
  std::string name;
  std::int64_t group_ms = 0;       // events within this time go into one message
  std::int64_t most_per_hour = 0;  // messages; 0: any number
  bool one_each = false;           // one message per event: logs
  // Events of low priority wait for this minute of the local day; nullopt: they don't wait.
  std::optional<int> digest_min{};
  const date::time_zone* zone = nullptr;  // of that day
};

struct RuleSettings {
  std::vector<ChannelRule> channels;
  std::vector<Route> routes;
  std::vector<QuietHours> quiet_hours;
  std::int64_t daemon_down_after_ms = 15'000;
};

}  // namespace loopwarden::notify
