// SPDX-License-Identifier: Apache-2.0
#include "model/alarm/loop_incident.hpp"

#include <algorithm>
#include <utility>

#include "model/alarm/limits.hpp"

namespace loopwarden::alarm {
namespace {

constexpr std::uint16_t bit_of(AlarmKind kind) noexcept {
  return static_cast<std::uint16_t>(1U << index_of(kind));
}

// Returns whether `kind` names a fault of the valve.
constexpr bool names_a_fault(AlarmKind kind) noexcept {
  return kind != AlarmKind::unknown && kind != AlarmKind::model_gap && !is_process_alarm(kind);
}

}  // namespace

LoopIncident::Changes LoopIncident::follow(std::int64_t now_ms, const LoopAlarms& alarms) {
  Changes changes;
  incident_.since_ms = std::min(incident_.since_ms, now_ms);
  bool any_on = false;
  for (const AlarmKind kind : kValveAlarms) {
    if (!alarms.alarm(kind).active()) continue;
    any_on = true;
    if (incident_.open() && incident_.has(kind)) continue;
    const bool joins = incident_.open();
    if (!joins) {
      incident_ = Incident{};
      incident_.opened_ms = incident_.since_ms = incident_.from_ms =
          std::min(now_ms, alarms.alarm(kind).memory().raised_ms);
    }
    incident_.alarms = static_cast<std::uint16_t>(incident_.alarms | bit_of(kind));
    changes.push_back({.kind = joins ? IncidentChange::Kind::joined : IncidentChange::Kind::opened,
                       .alarm = kind});
  }
  if (!incident_.open()) return changes;
  if (!changes.empty() && !incident_.explained()) name_by_alarms(now_ms, changes);
  if (any_on) {
    incident_.gone_ms = 0;
  } else if (incident_.gone_ms == 0 || now_ms < incident_.gone_ms) {
    incident_.gone_ms = now_ms;
  } else if (now_ms - incident_.gone_ms >= Limits::kQuiet_ms &&
             now_ms - incident_.since_ms >= Limits::kJoin_ms) {
    incident_.ended_ms = now_ms;
    changes.push_back({.kind = IncidentChange::Kind::ended});
  }
  return changes;
}

LoopIncident::Changes LoopIncident::explained(std::int64_t now_ms,
                                              const IncidentExplanation& explanation) {
  Changes changes;
  if (!incident_.there() || !incident_.has(explanation.alarm) ||
      !incident_.covers(explanation.raised_ms, now_ms)) {
    return changes;
  }
  const bool sure = gives_name(explanation.effect, explanation.confidence, explanation.gap_closed,
                               explanation.stick_seen);
  incident_.confidence = sure ? explanation.confidence : Incident::kNone;
  if (explanation.from_ms > 0 && explanation.from_ms < incident_.opened_ms) {
    incident_.from_ms = explanation.from_ms;
  }
  if (sure) {
    give_name(now_ms, explanation.effect, explanation.block, changes);
  } else {
    name_by_alarms(now_ms, changes);
  }
  return changes;
}

void LoopIncident::name_by_alarms(std::int64_t now_ms, Changes& changes) {
  const auto valve = [&](AlarmKind kind) {
    give_name(now_ms, to_text(kind), effects::Block::valve, changes);
  };
  if (incident_.has(AlarmKind::low_air_supply)) return valve(AlarmKind::low_air_supply);
  std::optional<AlarmKind> fault;
  for (const AlarmKind kind : kValveAlarms) {
    if (!names_a_fault(kind) || !incident_.has(kind)) continue;
    if (incident_.name == to_text(kind)) return valve(kind);  // the first one
    if (!fault) fault = kind;
  }
  if (fault) return valve(*fault);
  give_name(now_ms,
            incident_.has(AlarmKind::unknown) ? to_text(AlarmKind::unknown) : kNotAsCommissioned,
            std::nullopt, changes);
}

void LoopIncident::give_name(std::int64_t now_ms, const std::string& name,
                             std::optional<effects::Block> cause, Changes& changes) {
  incident_.cause = cause;
  const std::string before = std::exchange(incident_.name, name);
  if (before.empty() || before == name) return;
  incident_.renamed.push_back({now_ms, before, name});
  if (incident_.renamed.size() > kMostRenamed) incident_.renamed.erase(incident_.renamed.begin());
  changes.push_back({.kind = IncidentChange::Kind::renamed, .from = before});
}

bool unacknowledged(const Incident& incident, const LoopAlarms& alarms) noexcept {
  return std::any_of(kValveAlarms.begin(), kValveAlarms.end(), [&](AlarmKind kind) {
    return incident.has(kind) && alarms.alarm(kind).unacknowledged();
  });
}

}  // namespace loopwarden::alarm
