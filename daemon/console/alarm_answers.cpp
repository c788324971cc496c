// SPDX-License-Identifier: Apache-2.0
#include "daemon/console/alarm_answers.hpp"

#include <cstdlib>
#include <map>
#include <string>
#include <utility>

#include "model/alarm/box_alarms.hpp"
#include "model/alarm/limits.hpp"

namespace loopwarden::daemon::console {

using alarm::AlarmKind;

namespace {

protocol::AlarmDesign design_of(const config::LoopConfig& loop, AlarmKind kind) {
  const config::LoopAlarmConfig& alarms = loop.alarms;
  config::AlarmTexts texts = alarms.guide(kind);
  protocol::AlarmDesign design{.loop = loop.name,
                               .alarm = alarm::to_text(kind),
                               .priority = alarm::to_text(alarms.priority[alarm::index_of(kind)]),
                               .cause = std::move(texts.cause),
                               .consequence = std::move(texts.consequence),
                               .action = std::move(texts.action),
                               .time_to_act = std::move(texts.time_to_act)};
  if (alarm::is_process_alarm(kind)) {
    design.on_delay_s = alarms.process.at(kind).on_delay_s;
    design.off_delay_s = alarms.process.at(kind).off_delay_s;
  }
  if (kind >= alarm::kLimitAlarms.front()) {
    const alarm::Limit& limit = alarms.process.limits.at(kind);
    design.limit = limit.limit;
    design.dead_band = limit.dead_band;
    design.unit = loop.pv_unit + (kind == AlarmKind::rate_of_change ? "/s" : "");
  }
  for (const AlarmKind cause : alarm::kAlarmKinds) {
    if (alarm::follows(kind, cause)) design.suppressed_by.emplace_back(alarm::to_text(cause));
  }
  return design;
}

protocol::AlarmDesign design_of(alarm::BoxAlarm kind) {
  const alarm::AlarmGuide guide = alarm::guide_of(kind);
  return {.loop = alarm::kBox,
          .alarm = alarm::to_text(kind),
          .priority = alarm::to_text(alarm::usual_priority(kind)),
          .on_delay_s = static_cast<double>(alarm::on_delay_ms(kind)) / 1000.0,
          .off_delay_s = alarm::AlarmLimits::kOffDelay_s,
          .cause = guide.cause,
          .consequence = guide.consequence,
          .action = guide.action,
          .time_to_act = guide.time_to_act};
}

std::vector<protocol::AlarmFigures::Counted> counted(const std::vector<alarm::CountedAlarm>& all) {
  std::vector<protocol::AlarmFigures::Counted> list;
  for (const alarm::CountedAlarm& one : all) {
    list.push_back({one.source, one.alarm, one.count, one.percent});
  }
  return list;
}

void find_stale(const Plant& plant, std::int64_t now_ms, protocol::AlarmFigures& figures) {
  const auto look = [&](const std::string& source, const char* name, const alarm::Alarm& alarm) {
    const std::int64_t since_ms = alarm.memory().raised_ms;
    const bool shown = alarm.state() == alarm::AlarmState::unacknowledged ||
                       alarm.state() == alarm::AlarmState::acknowledged;
    // The age is unknown if the clock was ahead when the alarm was raised.
    if (shown && std::abs(now_ms - since_ms) > alarm::AlarmLimits::kStale_ms) {
      figures.stale.push_back({source, name, since_ms});
    }
  };
  for (std::size_t i = 0; i < plant.alarms.loops(); ++i) {
    plant.alarms.look(i, [&](const supervision::AlarmSnapshot& watch) {
      for (const AlarmKind kind : alarm::kAlarmKinds) {
        look(plant.alarms.name(i), alarm::to_text(kind), watch.alarms.alarm(kind));
      }
    });
  }
  const alarm::BoxAlarms of_box = plant.box_alarms.alarms();
  for (const alarm::BoxAlarm kind : alarm::kBoxAlarms) {
    look(alarm::kBox, alarm::to_text(kind), of_box.alarm(kind));
  }
}

}  // namespace

protocol::AlarmDesigns alarm_designs(const Plant& plant, std::size_t loop) {
  protocol::AlarmDesigns its;
  const alarm::LoopAlarms alarms = plant.alarms.snapshot(loop).alarms;
  for (const AlarmKind kind : alarm::kAlarmKinds) {
    if (alarms.fitted(kind)) its.alarms.push_back(design_of(plant.loops[loop].config, kind));
  }
  return its;
}

protocol::AlarmDesigns alarm_designs(const Plant& plant) {
  protocol::AlarmDesigns all;
  for (std::size_t i = 0; i < plant.loops.size(); ++i) {
    for (protocol::AlarmDesign& one : alarm_designs(plant, i).alarms) {
      all.alarms.push_back(std::move(one));
    }
  }
  for (const alarm::BoxAlarm kind : alarm::kBoxAlarms) all.alarms.push_back(design_of(kind));
  return all;
}

protocol::AlarmFigures figures_of(const Plant& plant, std::span<const alarm::AlarmCame> came,
                                  std::int64_t from_ms, std::int64_t to_ms) {
  std::map<std::pair<std::string, std::string>, std::string> priority;
  for (const protocol::AlarmDesign& one : alarm_designs(plant).alarms) {
    priority[{one.loop, one.alarm}] = one.priority;
  }
  protocol::AlarmFigures figures{.from_ms = from_ms, .to_ms = to_ms};
  for (const alarm::AlarmCame& one : came) {
    if (one.utc_ms < from_ms) continue;
    const auto known = priority.find({one.source, one.alarm});
    if (known != priority.end()) ++figures.priorities[known->second];
  }
  const alarm::AlarmFigures found = alarm::figures_of(came, from_ms, to_ms);
  figures.came = found.came;
  figures.per_hour = found.per_hour;
  figures.most_in_10_min = found.most_in_stretch;
  figures.floods = found.floods;
  figures.flood_percent = found.flood_percent;
  figures.top = counted(found.top);
  figures.chattering = counted(found.chattering);
  find_stale(plant, to_ms, figures);
  return figures;
}

}  // namespace loopwarden::daemon::console
