// SPDX-License-Identifier: Apache-2.0
#include "services/notify/rules/routing.hpp"

#include <fnmatch.h>

#include <algorithm>

#include "base/text.hpp"
#include "model/alarm/box_alarms.hpp"

namespace loopwarden::notify {
namespace {

bool is_severe_enough(const Route& route, std::optional<double> worst_percent) {
  return !worst_percent || *worst_percent >= route.min_severity_percent;
}

bool tells(const Route& route, Change change) {
  return route.changes.at(static_cast<std::size_t>(change));
}

bool has_alarm(const Route& route, const std::string& alarm) {
  return route.alarms.empty() ||
         std::find(route.alarms.begin(), route.alarms.end(), alarm) != route.alarms.end();
}

// The box has no area: a route with areas has it only by name.
bool has_area(const Route& route, const std::string& loop, const std::string& area) {
  if (route.areas.empty()) return true;
  if (loop == alarm::kBox) return !route.loops.empty();
  return std::any_of(route.areas.begin(), route.areas.end(),
                     [&](const auto& whole) { return base::is_in_area(area, whole); });
}

bool has_loop(const Route& route, const std::string& loop, const std::string& area) {
  if (!has_area(route, loop, area)) return false;
  return route.loops.empty() ||
         std::any_of(route.loops.begin(), route.loops.end(), [&](const auto& pattern) {
           return fnmatch(pattern.c_str(), loop.c_str(), FNM_NOESCAPE) == 0;
         });
}

// Returns whether the route has this loop and alarm. The daemon concerns every route, because
// without it no loop is watched. The box does so as well, unless a route names it.
bool concerns(const std::vector<Route>& routes, const Route& route, const Event& event) {
  if (!has_alarm(route, event.alarm)) return false;
  if (event.loop.empty() || has_loop(route, event.loop, event.area)) return true;
  return event.loop == alarm::kBox && box_way(routes, event.alarm) != BoxWay::own;
}

// Returns how often the step has fallen due until `at_ms`.
std::int64_t times_due(const Escalation& step, std::int64_t since_ms, std::int64_t at_ms) {
  const std::int64_t late_ms = at_ms - since_ms - step.after_min * kMinute;
  if (late_ms < 0) return 0;
  if (step.every_min == 0) return 1;
  return 1 + std::min(step.most, late_ms / (step.every_min * kMinute));
}

}  // namespace

BoxWay box_way(const std::vector<Route>& routes, const std::string& alarm) {
  BoxWay way = BoxWay::none;
  for (const Route& route : routes) {
    if (!tells(route, Change::came) || !has_alarm(route, alarm)) continue;
    const bool own = has_loop(route, alarm::kBox, {});
    if (own && !route.logs_only) return BoxWay::own;
    if (!own && !route.logs_only) way = BoxWay::all;
    if (way == BoxWay::none) way = BoxWay::logs;
  }
  return way;
}

ChannelNames channels_of(const std::vector<Route>& routes, const Event& event) {
  ChannelNames names;
  for (const Route& route : routes) {
    if (!tells(route, event.change) || !concerns(routes, route, event) ||
        !is_severe_enough(route, event.worst_percent)) {
      continue;
    }
    names.insert(route.channels.begin(), route.channels.end());
  }
  return names;
}

ChannelNames newly_told(const std::vector<Route>& routes, const Event& event,
                        std::optional<double> worst_before) {
  ChannelNames names;
  for (const Route& route : routes) {
    if (tells(route, Change::came) && concerns(routes, route, event) &&
        !is_severe_enough(route, worst_before) && is_severe_enough(route, event.worst_percent)) {
      names.insert(route.channels.begin(), route.channels.end());
    }
  }
  return names;
}

ChannelNames reminded(const std::vector<Route>& routes, const Event& event, std::int64_t since_ms,
                      std::int64_t from_ms, std::int64_t to_ms) {
  ChannelNames names;
  for (const Route& route : routes) {
    if (!tells(route, Change::came) || !concerns(routes, route, event) ||
        !is_severe_enough(route, event.worst_percent)) {
      continue;
    }
    for (const Escalation& step : route.reminders) {
      if (times_due(step, since_ms, to_ms) > times_due(step, since_ms, from_ms)) {
        names.insert(step.channels.begin(), step.channels.end());
      }
    }
  }
  return names;
}

}  // namespace loopwarden::notify
