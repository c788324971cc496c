// SPDX-License-Identifier: Apache-2.0
#include "services/notify/config/route_reader.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "model/alarm/alarm_kind.hpp"
#include "model/alarm/box_alarms.hpp"

namespace loopwarden::notify {
namespace {

using config::between;
using config::MapReader;
using config::Value;

constexpr std::int64_t kMostMinutes = 7L * 24 * 60;
constexpr std::int64_t kMostRepeats = 1000;

const std::vector<std::string> kChanges{"came", "went", "acknowledged", "shelved"};
const std::vector<std::string> kDays{"mon", "tue", "wed", "thu", "fri", "sat", "sun"};

std::vector<std::string> alarm_names() {
  std::vector<std::string> names{kDaemonAlarm};
  for (const alarm::AlarmKind kind : alarm::kAlarmKinds) names.emplace_back(to_text(kind));
  for (const alarm::BoxAlarm kind : alarm::kBoxAlarms) names.emplace_back(to_text(kind));
  return names;
}

// Reads the names of at least one existing channel.
std::vector<std::string> read_channels(MapReader& in, const std::vector<std::string>& channels) {
  const Value<std::vector<std::string>> named =
      in.maybe_words("channels", channels, "names of channels; required");
  if (!in.describing() && named.value.empty() && (!named.given || named.valid)) {
    in.error("channels", "must name a channel");
  }
  return named;
}

void read_changes(MapReader& in, Route& route) {
  const Value<std::vector<std::string>> changes =
      in.maybe_words("states", kChanges, "changes that are sent; [came, went] if not given");
  const std::vector<std::string> wanted =
      changes.given ? changes.value : std::vector<std::string>{"came", "went"};
  for (std::size_t i = 0; i < kChanges.size(); ++i) {
    route.changes.at(i) = std::find(wanted.begin(), wanted.end(), kChanges[i]) != wanted.end();
  }
}

std::int64_t read_minutes(MapReader& in, std::string_view key, const char* meaning) {
  return in.need_integer(key, {1, kMostMinutes, "min", meaning});
}

std::int64_t read_most(MapReader& in) {
  return in.integer("most", {1, kMostRepeats, "", "so often at most"}, 10);
}

Escalation read_step(MapReader& in, const std::vector<std::string>& channels) {
  Escalation step;
  step.after_min = read_minutes(in, "after_min", "time without acknowledgement");
  step.channels = read_channels(in, channels);
  const Value<std::int64_t> every =
      in.maybe_integer("every_min", {1, kMostMinutes, "min", "again and again", false, "once"});
  if (every.given) step.every_min = every;
  step.most = read_most(in);
  return step;
}

}  // namespace

int read_time(MapReader& in, std::string_view key, const char* meaning) {
  const Value<std::string> text = in.need_text(key, meaning);
  const std::string& t = text.value;
  const auto digit = [&](std::size_t i) { return t[i] >= '0' && t[i] <= '9'; };
  const bool shaped = t.size() == 5 && t[2] == ':' && digit(0) && digit(1) && digit(3) && digit(4);
  const int minutes =
      shaped ? ((t[0] - '0') * 10 + t[1] - '0') * 60 + (t[3] - '0') * 10 + t[4] - '0' : -1;
  if (shaped && t[3] < '6' && minutes <= 24 * 60) return minutes;
  if (text.given && text.valid) {
    in.error(key, fmt::format("must be a time of day, hh:mm (got '{}')", config::quotable(t)));
  }
  return 0;
}

Route read_route(MapReader& in, const std::vector<std::string>& channels) {
  Route route;
  route.loops = in.maybe_texts(
      "loops", "patterns of tags with * and ?, box for the box's own alarms; all if not given");
  route.areas =
      in.maybe_texts("areas", "areas with all their parts, such as Unit 2; all if not given");
  route.alarms = in.maybe_words("alarms", alarm_names(), "all if not given");
  read_changes(in, route);
  route.min_severity_percent = in.number(
      "min_severity_percent",
      {"%", between(0.0, 100.0), "of the CO span, and more; alarms without a size pass"}, 0.0);
  route.channels = read_channels(in, channels);
  if (auto repeat = in.maybe_section("repeat",
                                     "again to the same channels while the alarm is "
                                     "unacknowledged")) {
    const std::int64_t every_min = read_minutes(*repeat, "every_min", "between two");
    // The first notification is not a repeat.
    const std::int64_t most = read_most(*repeat);
    route.reminders.push_back({every_min, every_min, most - 1, route.channels});
  }
  for (MapReader& step : in.maybe_list("escalation", "steps while the alarm is unacknowledged")) {
    route.reminders.push_back(read_step(step, channels));
  }
  if (!in.describing() && !route.reminders.empty() && !route.changes[0]) {
    in.error("states", "must have `came` if the route repeats or escalates");
  }
  return route;
}

const date::time_zone* read_zone(MapReader& in, std::string_view key,
                                 const Value<std::string>& name) {
  const date::time_zone* zone = find_zone(name.value.empty() ? "UTC" : name.value);
  if (zone == nullptr && name.valid) {
    in.error(key, fmt::format("must be a time zone of the system, such as Europe/Berlin (got '{}')",
                              config::quotable(name.value)));
  }
  return zone != nullptr ? zone : find_zone("UTC");
}

QuietHours read_quiet_hours(MapReader& in, const std::vector<std::string>& channels) {
  QuietHours hours;
  hours.channels = read_channels(in, channels);
  const Value<std::string> zone =
      in.need_text("time_zone", "whose hours they are, such as Europe/Berlin");
  hours.zone = read_zone(in, "time_zone", zone);
  hours.from_min = read_time(in, "from", "hh:mm");
  hours.to_min = read_time(in, "to", "hh:mm, on the next day if it is not after `from`");
  if (!in.describing() && hours.from_min == 24 * 60) in.error("from", "must be before 24:00");
  const Value<std::vector<std::string>> days =
      in.maybe_words("days", kDays, "on which they begin; all if not given");
  for (std::size_t i = 0; days.given && i < kDays.size(); ++i) {
    hours.begins_on.at(i) =
        std::find(days.value.begin(), days.value.end(), kDays[i]) != days.value.end();
  }
  const Value<double> severe = in.maybe_number(
      "override_severity_percent",
      {"%", between(0.0, 100.0), "events from this severity on are sent all the same", "no event"});
  if (severe.given) hours.override_severity_percent = severe.value;
  hours.override_alarms = in.maybe_words("override_alarms", alarm_names(), "are sent all the same");
  return hours;
}

}  // namespace loopwarden::notify
