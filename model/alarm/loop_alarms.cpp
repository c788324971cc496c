// SPDX-License-Identifier: Apache-2.0
#include "model/alarm/loop_alarms.hpp"

#include <algorithm>
#include <utility>

namespace loopwarden::alarm {

LoopAlarms::LoopAlarms(const AlarmSettings& settings) noexcept {
  alarms_.fill(Alarm(settings));
  for (const AlarmKind kind : kValveAlarms) counts_for_[index_of(kind)].kind = kind;
  for (const AlarmKind kind : kProcessAlarms) alarms_[index_of(kind)].always_valid();
  for (const AlarmKind kind : kValveAlarms) fit(kind);
  for (const AlarmKind kind : {AlarmKind::bad_pv, AlarmKind::output_lost, AlarmKind::output_unknown,
                               AlarmKind::not_normal_mode}) {
    fit(kind);
  }
}

void LoopAlarms::restore(AlarmKind kind, const AlarmMemory& memory) noexcept {
  if (!fitted(kind)) return;
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

AlarmTransitions LoopAlarms::process_changed(std::int64_t now_ms,
                                             std::span<const ProcessChange> changes) noexcept {
  return after(AlarmReason::process, [&] {
    for (const ProcessChange& change : changes) {
      Alarm& alarm = alarms_[index_of(change.kind)];
      change.on ? alarm.condition_on(now_ms, 0.0) : alarm.condition_off(now_ms);
      if (change.on) began_[index_of(change.kind)] = change.began;
      // An alarm that clears while it is suppressed needs no acknowledgement: its cause was shown.
      if (!change.on && alarm.is_consequence()) alarm.acknowledge(now_ms);
      if (change.kind == AlarmKind::deviation && deviation_rests_) alarm.window_not_valid();
    }
  });
}

AlarmTransitions LoopAlarms::deviation_rests(bool rests) noexcept {
  return after(AlarmReason::process, [&] {
    deviation_rests_ = rests;
    Alarm& alarm = alarms_[index_of(AlarmKind::deviation)];
    rests ? alarm.window_not_valid() : alarm.always_valid();
  });
}

AlarmTransitions LoopAlarms::pv_lost(bool lost) noexcept {
  return after(AlarmReason::process, [&] { pv_lost_ = lost; });
}

bool LoopAlarms::follows_outage(AlarmKind kind) const noexcept {
  return behind_outage_ && !own_[index_of(kind)] && is_process_alarm(kind) &&
         kind != AlarmKind::enable_open && (!is_of_pv(kind) || pv_lost_);
}

AlarmTransitions LoopAlarms::behind_outage(bool behind) noexcept {
  return after(AlarmReason::process, [&] {
    behind_outage_ = behind;
    own_.fill(false);
  });
}

AlarmTransitions LoopAlarms::still_there(AlarmKind kind) noexcept {
  return after(AlarmReason::process, [&] { own_[index_of(kind)] = true; });
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
    result.accepted = alarms_[index_of(kind)].act(action, now_ms, until_ms);
  });
  return result;
}

void LoopAlarms::find_root() noexcept {
  for (const AlarmKind kind : kAlarmKinds) {
    const bool follows = follows_outage(kind) || cause_of(kind).has_value();
    alarms_[index_of(kind)].set_consequence(fitted(kind) && follows);
  }
}

std::optional<AlarmKind> LoopAlarms::cause_of(AlarmKind kind) const noexcept {
  if (own_[index_of(kind)]) return std::nullopt;  // its cause clears, but it stays
  for (const AlarmKind cause : kAlarmKinds) {
    const bool known = is_of_pv(kind) && loses_pv(cause) && !pv_lost_;
    if (follows(kind, cause) && alarm(cause).active() && !known) return cause;
  }
  return std::nullopt;
}

bool LoopAlarms::first_out(AlarmKind kind) const noexcept {
  // A consequence of another alarm is not first, though it may begin in the same cycle.
  const auto there = [this](AlarmKind one) {
    return (alarm(one).active() || alarm(one).unacknowledged()) && !alarm(one).is_consequence();
  };
  if (!is_process_alarm(kind) || !there(kind)) return false;
  bool others = false;
  for (const AlarmKind other : kProcessAlarms) {
    if (other == kind || !there(other)) continue;
    others = true;
    if (began_before(other, kind)) return false;
  }
  return others;
}

bool LoopAlarms::began_before(AlarmKind one, AlarmKind other) const noexcept {
  const auto rank = [this, one, other](AlarmKind kind) {
    // Periods are counted from the start. Older alarms have only their time.
    const bool both = began_[index_of(one)] != 0 && began_[index_of(other)] != 0;
    return std::pair(
        both ? static_cast<std::int64_t>(began_[index_of(kind)]) : alarm(kind).memory().raised_ms,
        kind);
  };
  return rank(one) < rank(other);
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

}  // namespace loopwarden::alarm
