// SPDX-License-Identifier: Apache-2.0
#include "model/monitor/loop_alarms.hpp"

#include <algorithm>

namespace loopwarden::monitor {

LoopAlarms::LoopAlarms(const AlarmSettings& settings) noexcept {
  alarms_.fill(Alarm(settings));
  for (const AlarmKind kind : kValveAlarms) counts_for_[index_of(kind)].kind = kind;
  for (const AlarmKind kind : kProcessAlarms) alarms_[index_of(kind)].always_valid();
}

void LoopAlarms::restore(AlarmKind kind, const AlarmMemory& memory) noexcept {
  Alarm& alarm = alarms_[index_of(kind)];
  alarm = Alarm(alarm.settings(), memory);
  if (is_process_alarm(kind)) alarm.always_valid();
  find_root();
}

template <class Change>
AlarmTransitions LoopAlarms::after(AlarmReason reason, Change change) noexcept {
  const States before = states();
  change();
  find_root();
  return since(before, reason);
}

AlarmTransitions LoopAlarms::judged(std::int64_t now_ms, const AlarmConditions& conditions,
                                    AlarmReason by) noexcept {
  return after(by, [&] {
    AlarmConditions counted{};
    for (const AlarmKind kind : kValveAlarms) {
      const AlarmCondition& condition = conditions[index_of(kind)];
      CountsFor& as = counts_for_[index_of(kind)];
      on_[index_of(kind)] = condition.on;
      if (!condition.on) {
        as.kind = kind;
        continue;
      }
      AlarmCondition& one = counted[index_of(as.kind)];
      const double severity = as.kind == kind ? condition.severity_percent : as.severity_percent;
      one = {true, std::max(one.severity_percent, severity)};
    }
    for (std::size_t i = 0; i < kValveAlarmCount; ++i) {
      if (counted[i].on) {
        alarms_[i].condition_on(now_ms, counted[i].severity_percent);
      } else {
        alarms_[i].condition_off(now_ms);
      }
    }
  });
}

AlarmTransitions LoopAlarms::explained(std::int64_t now_ms, AlarmKind kind, AlarmKind as,
                                       double severity_percent) noexcept {
  return after(AlarmReason::explained, [&] {
    const AlarmKind was = counts_for_[index_of(kind)].kind;
    if (was == as || !alarms_[index_of(was)].active()) return;
    counts_for_[index_of(kind)] = {as, severity_percent};
    const bool of_another =
        std::any_of(kValveAlarms.begin(), kValveAlarms.end(), [&](AlarmKind other) {
          return other != kind && on_[index_of(other)] && counts_for_[index_of(other)].kind == was;
        });
    if (!of_another) alarms_[index_of(was)].take_back(now_ms);
    alarms_[index_of(as)].condition_on(now_ms, severity_percent);
  });
}

AlarmTransitions LoopAlarms::window_not_valid() noexcept {
  return after(AlarmReason::windows, [&] {
    for (const AlarmKind kind : kValveAlarms) alarms_[index_of(kind)].window_not_valid();
  });
}

AlarmTransitions LoopAlarms::process_changed(std::int64_t now_ms, AlarmKind kind,
                                             bool on) noexcept {
  return after(AlarmReason::process, [&] {
    Alarm& alarm = alarms_[index_of(kind)];
    on ? alarm.condition_on(now_ms, 0.0) : alarm.condition_off(now_ms);
  });
}

AlarmTransitions LoopAlarms::pass_time(std::int64_t now_ms) noexcept {
  return after(AlarmReason::by_operator, [&] {
    for (Alarm& alarm : alarms_) alarm.pass_time(now_ms);
  });
}

LoopAlarms::ActionResult LoopAlarms::act(AlarmKind kind, AlarmAction action, std::int64_t now_ms,
                                         std::int64_t until_ms) noexcept {
  ActionResult result;
  result.transitions = after(AlarmReason::by_operator, [&] {
    Alarm& alarm = alarms_[index_of(kind)];
    switch (action) {
      case AlarmAction::acknowledge: result.accepted = alarm.acknowledge(now_ms); break;
      case AlarmAction::reset: result.accepted = alarm.reset(now_ms); break;
      case AlarmAction::shelve: result.accepted = alarm.shelve(now_ms, until_ms); break;
      case AlarmAction::unshelve: result.accepted = alarm.unshelve(now_ms); break;
    }
  });
  return result;
}

void LoopAlarms::find_root() noexcept {
  const bool low_air = alarm(AlarmKind::low_air_supply).active();
  for (const AlarmKind kind : kValveAlarms) {
    if (kind != AlarmKind::low_air_supply) alarms_[index_of(kind)].set_consequence(low_air);
  }
}

LoopAlarms::States LoopAlarms::states() const noexcept {
  States now{};
  for (std::size_t i = 0; i < kAlarmKindCount; ++i) now[i] = alarms_[i].state();
  return now;
}

AlarmTransitions LoopAlarms::since(const States& before, AlarmReason reason) const noexcept {
  AlarmTransitions changed;
  for (const AlarmKind kind : kAlarmKinds) {
    const AlarmState now = alarm(kind).state();
    const AlarmState was = before[index_of(kind)];
    if (now != was) changed.add({kind, was, now, alarm(kind).memory().severity_percent, reason});
  }
  return changed;
}

bool LoopAlarms::any_shelved() const noexcept {
  return std::any_of(alarms_.begin(), alarms_.end(),
                     [](const Alarm& alarm) { return alarm.shelved(); });
}

bool LoopAlarms::any_suppressed() const noexcept {
  return std::any_of(alarms_.begin(), alarms_.end(),
                     [](const Alarm& alarm) { return alarm.state() == AlarmState::suppressed; });
}

}  // namespace loopwarden::monitor
