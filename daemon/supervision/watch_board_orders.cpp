// SPDX-License-Identifier: Apache-2.0
// What operators do with alarms and incidents.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "daemon/journal/incident_text.hpp"
#include "daemon/supervision/watch_board.hpp"

namespace loopwarden::daemon::supervision {

using alarm::AlarmAction;
using alarm::AlarmKind;
using journal::JournalEntry;

OrderResult WatchBoard::act(std::size_t loop, const AlarmOrder& order) {
  const std::lock_guard lock(mutex_);
  return act_locked(loop, order);
}

OrderResult WatchBoard::act_locked(std::size_t loop, const AlarmOrder& order) {
  OrderResult result;
  alarm::LoopAlarms& alarms = watches_[loop].alarms;
  if (!alarms.fitted(order.kind)) {
    result.why = fmt::format("{} has no alarm {}: its file gives none", names_[loop],
                             alarm::to_text(order.kind));
    return result;
  }
  const std::int64_t now_ms = utc_ms_();
  const Memories before = memories(loop);
  const auto done = alarms.act(order.kind, order.action, now_ms, now_ms + order.shelve_ms);
  const alarm::Alarm& alarm = alarms.alarm(order.kind);
  result.accepted = done.accepted;
  if (!done.accepted) result.why = why_refused(order, names_[loop], alarm);
  const std::uint64_t ordered =
      journal_.post(line_of(order, names_[loop], result, alarm.memory(), now_ms));
  const std::uint64_t changed = write_down(loop, before, done.transitions);
  if (result.accepted) result.ticket = std::max(ordered, changed);
  return result;
}

OrderResult WatchBoard::acknowledge_incident(std::size_t loop, const std::string& id,
                                             const std::string& peer, const std::string& reason) {
  const std::lock_guard lock(mutex_);
  const LoopWatch& watch = watches_[loop];
  const alarm::Incident incident = watch.incident.incident();
  OrderResult done;
  if (!incident.there() || journal::incident_id(names_[loop], incident) != id) {
    done.why =
        fmt::format("{} has no incident '{}'; its newest is {}", names_[loop], id,
                    incident.there() ? journal::incident_id(names_[loop], incident) : "none");
    return done;
  }
  for (const AlarmKind kind : alarm::kValveAlarms) {
    if (!incident.has(kind) || !watch.alarms.alarm(kind).unacknowledged()) continue;
    const OrderResult one = act_locked(loop, {kind, AlarmAction::acknowledge, 0, peer, reason});
    done.accepted = done.accepted || one.accepted;
    done.ticket = std::max(done.ticket, one.ticket);
  }
  if (!done.accepted) done.why = fmt::format("incident {}: nothing to acknowledge", id);
  return done;
}

Acknowledged WatchBoard::acknowledge_all(std::span<const AlarmKind> kinds, const std::string& peer,
                                         const std::string& reason) {
  const std::lock_guard lock(mutex_);
  Acknowledged done;
  for (std::size_t i = 0; i < watches_.size(); ++i) {
    for (const AlarmKind kind : kinds) {
      if (!watches_[i].alarms.alarm(kind).unacknowledged()) continue;
      const OrderResult result = act_locked(i, {kind, AlarmAction::acknowledge, 0, peer, reason});
      if (!result.accepted) continue;
      done.alarms.push_back({i, kind});
      done.ticket = result.ticket;
    }
  }
  return done;
}

OrderResult WatchBoard::set_veto(std::size_t loop, alarm::Veto veto, const std::string& peer,
                                 const std::string& reason) {
  OrderResult result;
  const std::lock_guard lock(mutex_);
  LoopWatch& watch = watches_[loop];
  // Masters repeat what they have written: no news, no line.
  if (watch.veto == veto && watch.corrective != alarm::CorrectiveState::off) return {true, {}, 0};
  result.accepted = watch.corrective != alarm::CorrectiveState::off;
  if (!result.accepted) {
    result.why = names_[loop] + " has no corrective action (monitor.corrective_action)";
  }
  JournalEntry entry;
  entry.kind = JournalEntry::Kind::operator_action;
  entry.utc_ms = utc_ms_();
  entry.loop = names_[loop];
  entry.peer = peer;
  entry.what = veto != alarm::Veto::none ? "veto of corrective action" : "veto lifted";
  entry.reason = reason;
  entry.result = result.accepted ? "done" : "refused: " + result.why;
  if (result.accepted) watch.veto = veto;
  const std::uint64_t ticket = journal_.post(std::move(entry));
  if (result.accepted) result.ticket = ticket;
  return result;
}

OrderResult WatchBoard::begin_offered(std::size_t loop, const std::string& peer,
                                      const std::string& reason) {
  OrderResult result;
  const std::lock_guard lock(mutex_);
  LoopWatch& watch = watches_[loop];
  result.accepted = watch.corrective == alarm::CorrectiveState::offered;
  if (!result.accepted) {
    result.why = fmt::format("corrective action of {} is {}: it offers nothing", names_[loop],
                             alarm::to_text(watch.corrective));
  }
  JournalEntry entry;
  entry.kind = JournalEntry::Kind::operator_action;
  entry.utc_ms = utc_ms_();
  entry.loop = names_[loop];
  entry.peer = peer;
  entry.what = "planned moves ordered";
  entry.reason = reason;
  entry.result = result.accepted ? "done" : "refused: " + result.why;
  watch.ordered = result.accepted;
  const std::uint64_t ticket = journal_.post(std::move(entry));
  if (result.accepted) result.ticket = ticket;
  return result;
}

}  // namespace loopwarden::daemon::supervision
