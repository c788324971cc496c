// SPDX-License-Identifier: Apache-2.0
#include "model/alarm/alarm.hpp"

#include <algorithm>
#include <cmath>

namespace loopwarden::alarm {

Alarm::Alarm(const AlarmSettings& settings, const AlarmMemory& memory) noexcept
    : settings_(settings), memory_(memory) {
  const bool possible = memory.raised <= AlarmState::latched_acknowledged &&
                        memory.shelved_until_ms >= 0 && std::isfinite(memory.severity_percent) &&
                        std::isfinite(memory.worst_severity_percent);
  if (!possible) memory_ = {};
}

void Alarm::condition_on(std::int64_t now_ms, double severity_percent) noexcept {
  window_valid_ = true;
  const bool was_on = active();
  const double severity = std::isfinite(severity_percent) ? severity_percent : 0.0;
  memory_.severity_percent = severity;
  memory_.worst_severity_percent =
      was_on ? std::max(memory_.worst_severity_percent, severity) : severity;
  if (was_on) return;
  memory_.raised_ms = now_ms;
  ++memory_.times_raised;
  change(AlarmState::unacknowledged, now_ms);
}

void Alarm::condition_off(std::int64_t now_ms) noexcept {
  window_valid_ = true;
  if (memory_.raised == AlarmState::unacknowledged) {
    change(settings_.latching ? AlarmState::latched_unacknowledged
                              : AlarmState::returned_unacknowledged,
           now_ms);
  } else if (memory_.raised == AlarmState::acknowledged) {
    change(settings_.latching ? AlarmState::latched_acknowledged : AlarmState::normal, now_ms);
  }
}

bool Alarm::acknowledge(std::int64_t now_ms) noexcept {
  if (shelved()) return false;
  switch (memory_.raised) {
    case AlarmState::unacknowledged: change(AlarmState::acknowledged, now_ms); return true;
    case AlarmState::returned_unacknowledged: change(AlarmState::normal, now_ms); return true;
    case AlarmState::latched_unacknowledged:
      change(AlarmState::latched_acknowledged, now_ms);
      return true;
    case AlarmState::normal:
    case AlarmState::acknowledged:
    case AlarmState::latched_acknowledged:
    case AlarmState::shelved:
    case AlarmState::suppressed: break;
  }
  return false;
}

bool Alarm::reset(std::int64_t now_ms) noexcept {
  if (shelved()) return false;
  switch (memory_.raised) {
    case AlarmState::latched_unacknowledged:
      change(AlarmState::returned_unacknowledged, now_ms);
      return true;
    case AlarmState::latched_acknowledged: change(AlarmState::normal, now_ms); return true;
    case AlarmState::normal:
    case AlarmState::unacknowledged:
    case AlarmState::acknowledged:
    case AlarmState::returned_unacknowledged:
    case AlarmState::shelved:
    case AlarmState::suppressed: break;
  }
  return false;
}

bool Alarm::shelve(std::int64_t now_ms, std::int64_t until_ms) noexcept {
  if (until_ms <= now_ms || until_ms - now_ms > settings_.shelve_limit_ms) return false;
  memory_.shelved_until_ms = until_ms;
  memory_.changed_ms = now_ms;
  return true;
}

bool Alarm::unshelve(std::int64_t now_ms) noexcept {
  if (!shelved()) return false;
  take_off_shelf(now_ms);
  return true;
}

bool Alarm::act(AlarmAction action, std::int64_t now_ms, std::int64_t until_ms) noexcept {
  switch (action) {
    case AlarmAction::acknowledge: return acknowledge(now_ms);
    case AlarmAction::reset: return reset(now_ms);
    case AlarmAction::shelve: return shelve(now_ms, until_ms);
    case AlarmAction::unshelve: break;
  }
  return unshelve(now_ms);
}

bool Alarm::pass_time(std::int64_t now_ms) noexcept {
  if (!shelved()) return false;
  const std::int64_t left_ms = memory_.shelved_until_ms - now_ms;
  if (left_ms > 0 && left_ms <= settings_.shelve_limit_ms) return false;
  take_off_shelf(now_ms);
  return true;
}

void Alarm::take_off_shelf(std::int64_t now_ms) noexcept {
  memory_.shelved_until_ms = 0;
  memory_.changed_ms = now_ms;
  if (memory_.raised == AlarmState::acknowledged) change(AlarmState::unacknowledged, now_ms);
  if (memory_.raised == AlarmState::returned_unacknowledged) change(AlarmState::normal, now_ms);
}

void Alarm::change(AlarmState raised, std::int64_t now_ms) noexcept {
  memory_.raised = raised;
  memory_.changed_ms = now_ms;
}

AlarmState Alarm::state() const noexcept {
  if (shelved()) return AlarmState::shelved;
  if (consequence_) return AlarmState::suppressed;
  if (memory_.raised == AlarmState::normal && !window_valid_) return AlarmState::suppressed;
  return memory_.raised;
}

bool Alarm::active() const noexcept {
  return memory_.raised == AlarmState::unacknowledged || memory_.raised == AlarmState::acknowledged;
}

bool Alarm::unacknowledged() const noexcept {
  const AlarmState now = state();
  return now == AlarmState::unacknowledged || now == AlarmState::returned_unacknowledged ||
         now == AlarmState::latched_unacknowledged;
}

}  // namespace loopwarden::alarm
