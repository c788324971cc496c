// SPDX-License-Identifier: Apache-2.0
#include "services/notify/rules/changes.hpp"

#include <algorithm>
#include <string_view>

namespace loopwarden::notify {
namespace {

bool waits(std::string_view state) noexcept {
  return state == "unacknowledged" || state == "returned_unacknowledged" ||
         state == "latched_unacknowledged";
}

bool is_off(std::string_view state) noexcept {
  return state == "normal" || state == "returned_unacknowledged" || state.starts_with("latched_");
}

// Returns whether the operator acknowledged an active alarm, or a cleared one that waited for it.
bool is_acknowledgement(std::string_view before, std::string_view now) noexcept {
  const bool seen = now == "acknowledged" || now == "latched_acknowledged";
  const bool waited_off = before == "returned_unacknowledged" || before == "latched_unacknowledged";
  return seen || (waited_off && now == "normal");
}

std::optional<double> worse(std::optional<double> a, std::optional<double> b) noexcept {
  return a && b ? std::max(*a, *b) : a ? a : b;
}

}  // namespace

bool is_told(const std::string& state) noexcept {
  return state == "unacknowledged" || state == "acknowledged";
}

Event event_of_reading(const AlarmReading& reading, const AlarmPicture& picture, Change change,
                       std::int64_t utc_ms, std::int64_t noticed_ms) {
  return {.utc_ms = utc_ms,
          .loop = reading.key.first,
          .alarm = reading.key.second,
          .change = change,
          .state = reading.state,
          .severity_percent = reading.severity_percent,
          .worst_percent = picture.worst_percent,
          .description = reading.description,
          .noticed_ms = noticed_ms,
          .area = reading.area,
          .priority = reading.priority,
          .of_incident = !reading.incident.empty(),
          .incident_name = reading.incident_name,
          .why = reading.why,
          .consequence = reading.consequence,
          .action = reading.action,
          .time_to_act = reading.time_to_act};
}

void bring_up_to_date(Event& event, std::span<const AlarmReading> readings) {
  constexpr std::string_view kUnnamed = "model_gap";  // something has changed
  if (event.change != Change::came && event.change != Change::unacknowledged) return;
  const auto find = [&](auto is) { return std::find_if(readings.begin(), readings.end(), is); };
  auto now = find([&](const AlarmReading& one) {
    return one.key == AlarmKey{event.loop, event.alarm} && is_told(one.state);
  });
  if (now == readings.end()) return;
  if (event.alarm == kUnnamed && !now->incident.empty()) {
    const auto named = find([&](const AlarmReading& one) {
      return one.incident == now->incident && one.key.second != kUnnamed && is_told(one.state);
    });
    if (named != readings.end()) now = named;
  }
  event.alarm = now->key.second;
  event.incident_name = now->incident_name;
  event.severity_percent = now->severity_percent;
  event.priority = now->priority;
  event.why = now->why;
  event.consequence = now->consequence;
  event.action = now->action;
  event.time_to_act = now->time_to_act;
}

AlarmPicture first_picture(const AlarmReading& reading) {
  AlarmPicture picture;
  picture.times_raised = reading.times_raised;
  return picture;
}

std::vector<Event> take_changes(AlarmPicture& picture, const AlarmReading& reading,
                                std::int64_t now_ms) {
  const std::string before = picture.state;
  const std::string& now = reading.state;
  const bool again = reading.times_raised > picture.times_raised;
  const bool came = is_told(now) ? !is_told(before) || again : again && is_off(now);
  const bool went = (is_told(before) || came) && (is_off(now) || now == "suppressed");

  picture.state = now;
  picture.unacknowledged = reading.unacknowledged;
  picture.times_raised = reading.times_raised;
  if (came) {
    picture.worst_percent = reading.severity_percent;
    picture.since_ms = now_ms;
    picture.reminded_ms = now_ms;
  } else {
    picture.worst_percent = worse(picture.worst_percent, reading.severity_percent);
  }

  // A later time means that a clock was set back.
  const auto at = [now_ms](std::int64_t ms) { return ms > 0 && ms <= now_ms ? ms : now_ms; };
  // An alarm that leaves a shelf or a suppression was raised earlier, and is reported now.
  const bool back = !again && (before == "shelved" || before == "suppressed");
  std::vector<Event> events;
  const auto add = [&](Change change, std::int64_t utc_ms) {
    events.push_back(event_of_reading(reading, picture, change, utc_ms, now_ms));
  };
  const std::int64_t changed_ms = at(reading.changed_ms);
  if (came) add(Change::came, back ? now_ms : at(reading.raised_ms));
  if ((waits(before) || came) && is_acknowledgement(before, now)) {
    add(Change::acknowledged, changed_ms);
  }
  if (went) add(Change::went, now == "suppressed" ? now_ms : changed_ms);
  if (now == "shelved" && before != "shelved") add(Change::shelved, changed_ms);
  return events;
}

}  // namespace loopwarden::notify
