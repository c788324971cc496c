// SPDX-License-Identifier: Apache-2.0
// Operators' actions on alarms, incidents and corrective action.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "daemon/journal/incident_text.hpp"
#include "daemon/supervision/journaled_alarms.hpp"

namespace loopwarden::daemon::supervision {

using alarm::AlarmAction;
using alarm::AlarmKind;
using journal::JournalEntry;

CommandResult JournaledAlarms::act(const AlarmCommand& command) {
  const std::lock_guard lock(mutex_);
  return act_locked(command);
}

CommandResult JournaledAlarms::act_locked(const AlarmCommand& command) {
  CommandResult result;
  alarm::LoopAlarms& alarms = snapshot_.alarms;
  if (!alarms.fitted(command.kind)) {
    result.why =
        fmt::format("{} has no alarm {}: its file gives none", name_, alarm::to_text(command.kind));
    return result;
  }
  const std::int64_t now_ms = utc_ms_();
  const Memories before = memories();
  const auto done = alarms.act(command.kind, command.action, now_ms, now_ms + command.shelve_ms);
  const alarm::Alarm& alarm = alarms.alarm(command.kind);
  result.accepted = done.accepted;
  if (!done.accepted) result.why = why_refused(command, name_, alarm);
  const std::uint64_t ordered =
      journal_.post(line_of(command, name_, result, alarm.memory(), now_ms));
  const std::uint64_t changed = write_down(before, done.transitions);
  if (result.accepted) result.ticket = std::max(ordered, changed);
  return result;
}

CommandResult JournaledAlarms::acknowledge_incident(const std::string& id, const std::string& peer,
                                                    const std::string& reason) {
  const std::lock_guard lock(mutex_);
  const alarm::Incident incident = snapshot_.incident.incident();
  CommandResult done;
  if (!incident.there() || journal::incident_id(name_, incident) != id) {
    done.why = fmt::format("{} has no incident '{}'; its newest is {}", name_, id,
                           incident.there() ? journal::incident_id(name_, incident) : "none");
    return done;
  }
  for (const AlarmKind kind : alarm::kValveAlarms) {
    if (!incident.has(kind) || !snapshot_.alarms.alarm(kind).unacknowledged()) continue;
    const CommandResult one = act_locked({kind, AlarmAction::acknowledge, 0, peer, reason});
    done.accepted = done.accepted || one.accepted;
    done.ticket = std::max(done.ticket, one.ticket);
  }
  if (!done.accepted) done.why = fmt::format("incident {}: nothing to acknowledge", id);
  return done;
}

std::uint64_t JournaledAlarms::acknowledge(std::span<const AlarmKind> kinds,
                                           const std::string& peer, const std::string& reason,
                                           std::vector<AlarmKind>& acknowledged) {
  const std::lock_guard lock(mutex_);
  std::uint64_t ticket = 0;
  for (const AlarmKind kind : kinds) {
    if (!snapshot_.alarms.alarm(kind).unacknowledged()) continue;
    const CommandResult result = act_locked({kind, AlarmAction::acknowledge, 0, peer, reason});
    if (!result.accepted) continue;
    acknowledged.push_back(kind);
    ticket = result.ticket;
  }
  return ticket;
}

CommandResult JournaledAlarms::set_veto(alarm::Veto veto, const std::string& peer,
                                        const std::string& reason) {
  CommandResult result;
  const std::lock_guard lock(mutex_);
  // A Modbus master repeats its writes: no line without a change.
  if (snapshot_.veto == veto && snapshot_.corrective != alarm::CorrectiveState::off)
    return {true, {}, 0};
  result.accepted = snapshot_.corrective != alarm::CorrectiveState::off;
  if (!result.accepted) {
    result.why = name_ + " has no corrective action (monitor.corrective_action)";
  }
  JournalEntry entry;
  entry.kind = JournalEntry::Kind::operator_action;
  entry.utc_ms = now_ms();
  entry.loop = name_;
  entry.peer = peer;
  entry.what = veto != alarm::Veto::none ? "veto of corrective action" : "veto lifted";
  entry.reason = reason;
  entry.result = result.accepted ? "done" : "refused: " + result.why;
  if (result.accepted) snapshot_.veto = veto;
  const std::uint64_t ticket = journal_.post(std::move(entry));
  if (result.accepted) result.ticket = ticket;
  return result;
}

CommandResult JournaledAlarms::begin_offered(const std::string& peer, const std::string& reason) {
  CommandResult result;
  const std::lock_guard lock(mutex_);
  result.accepted = snapshot_.corrective == alarm::CorrectiveState::offered;
  if (!result.accepted) {
    result.why = fmt::format("corrective action of {} is {}: it offers nothing", name_,
                             alarm::to_text(snapshot_.corrective));
  }
  JournalEntry entry;
  entry.kind = JournalEntry::Kind::operator_action;
  entry.utc_ms = now_ms();
  entry.loop = name_;
  entry.peer = peer;
  entry.what = "planned moves ordered";
  entry.reason = reason;
  entry.result = result.accepted ? "done" : "refused: " + result.why;
  snapshot_.ordered = result.accepted;
  const std::uint64_t ticket = journal_.post(std::move(entry));
  if (result.accepted) result.ticket = ticket;
  return result;
}

}  // namespace loopwarden::daemon::supervision
