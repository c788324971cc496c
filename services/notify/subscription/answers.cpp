// SPDX-License-Identifier: Apache-2.0
#include "services/notify/subscription/answers.hpp"

#include <fmt/format.h>

#include <cmath>
#include <optional>

#include "services/notify/text/one_line.hpp"

namespace loopwarden::notify {

std::vector<AlarmReading> readings_of(const protocol::Alarms& all) {
  std::map<AlarmKey, const protocol::Incident*> incidents;
  for (const protocol::Incident& incident : all.incidents) {
    for (const std::string& alarm : incident.alarms) {
      incidents[{one_line(incident.loop), one_line(alarm)}] = &incident;
    }
  }
  std::vector<AlarmReading> readings;
  for (const protocol::Alarm& alarm : all.alarms) {
    const double percent = alarm.severity_percent;
    readings.push_back(
        {.key = {one_line(alarm.loop), one_line(alarm.alarm)},
         .state = one_line(alarm.state),
         .unacknowledged = alarm.unacknowledged,
         .times_raised = static_cast<std::int64_t>(alarm.times_raised),
         .severity_percent = std::isfinite(percent) ? std::optional(percent) : std::nullopt,
         .raised_ms = alarm.raised_ms,
         .changed_ms = alarm.changed_ms,
         .priority = one_line(alarm.priority)});
    const auto incident = incidents.find(readings.back().key);
    if (incident == incidents.end()) continue;
    readings.back().incident = one_line(incident->second->id);
    readings.back().incident_name = one_line(incident->second->name);
    if (const double opened_s = incident->second->raised_s; std::isfinite(opened_s)) {
      readings.back().incident_ms = std::llround(1000.0 * opened_s);
    }
    readings.back().incident_says =
        fmt::format("{} {}", one_line(incident->second->name), incident->second->confidence);
  }
  return readings;
}

std::vector<JournalLine> lines_of(const protocol::Journal& journal) {
  std::vector<JournalLine> lines;
  for (const protocol::JournalLine& line : journal.lines) {
    lines.push_back({.id = line.id,
                     .kind = one_line(line.kind),
                     .key = {one_line(line.loop), one_line(line.alarm)},
                     .from = one_line(line.from),
                     .to = one_line(line.to),
                     .peer = one_line(line.peer),
                     .what = one_line(line.what),
                     .reason = one_line(line.reason)});
  }
  return lines;
}

std::map<std::string, LoopWords> words_of(const protocol::Description& about) {
  std::map<std::string, LoopWords> all;
  for (const protocol::LoopDescription& loop : about.loops) {
    all[one_line(loop.tag)] = {one_line(loop.description), one_line(loop.area)};
  }
  return all;
}

AlarmWords words_of(const protocol::Explained& told, const AlarmReading& reading) {
  AlarmWords words{.why = one_line(told.alarm.about),
                   .consequence = one_line(told.consequence),
                   .action = one_line(told.action),
                   .time_to_act = one_line(told.time_to_act)};
  // An alarm that joined an incident later has the explanation of the alarm that opened it.
  const std::int64_t since_ms =
      reading.incident.empty() ? told.alarm.raised_ms : reading.incident_ms;
  if (told.explanation && told.explanation->raised_ms >= since_ms) {
    words.why = one_line(told.explanation->sentence);
    if (!told.explanation->next_test.empty()) {
      words.why += " " + one_line(told.explanation->next_test);
    }
    if (!told.explanation->remedy.empty()) words.action = one_line(told.explanation->remedy);
  }
  return words;
}

}  // namespace loopwarden::notify
