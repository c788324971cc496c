// SPDX-License-Identifier: Apache-2.0
#include "daemon/host/host_alarms.hpp"

#include <algorithm>

namespace loopwarden::daemon::host {

using alarm::BoxAlarm;
using journal::JournalEntry;

void HostAlarms::restore(const journal::AlarmStates& states) {
  const std::lock_guard lock(mutex_);
  for (const BoxAlarm kind : alarm::kBoxAlarms) {
    const auto found = states.memories.find({alarm::kBox, alarm::to_text(kind)});
    if (found != states.memories.end()) alarms_.restore(kind, found->second);
  }
}

void HostAlarms::look(const BoxReport& report, std::int64_t monotonic_ms) {
  const std::lock_guard lock(mutex_);
  newest_ = report;
  const alarm::BoxAlarms before = alarms_;
  if (alarms_.found(report.found, monotonic_ms, utc_ms_())) write_changes(before);
}

supervision::CommandResult HostAlarms::act(const BoxCommand& order) {
  const std::lock_guard lock(mutex_);
  return act_locked(order);
}

supervision::CommandResult HostAlarms::act_locked(const BoxCommand& order) {
  const alarm::BoxAlarms before = alarms_;
  const std::int64_t now_ms = utc_ms_();
  const alarm::Alarm& alarm = alarms_.alarm(order.kind);
  supervision::CommandResult result;
  result.accepted = alarms_.act(order.kind, order.action, now_ms, now_ms + order.shelve_ms);
  if (!result.accepted) result.why = why_refused(order, alarm::kBox, alarm);
  const std::uint64_t ordered =
      journal_.post(line_of(order, alarm::kBox, result, alarm.memory(), now_ms));
  const std::uint64_t changed = write_changes(before);
  if (result.accepted) result.ticket = std::max(ordered, changed);
  return result;
}

BoxAcknowledged HostAlarms::acknowledge_all(const std::string& peer, const std::string& reason) {
  const std::lock_guard lock(mutex_);
  BoxAcknowledged done;
  for (const BoxAlarm kind : alarm::kBoxAlarms) {
    if (!alarms_.alarm(kind).unacknowledged()) continue;
    done.ticket = act_locked({kind, alarm::AlarmAction::acknowledge, 0, peer, reason}).ticket;
    done.alarms.push_back(kind);
  }
  return done;
}

alarm::BoxAlarms HostAlarms::alarms() const {
  const std::lock_guard lock(mutex_);
  return alarms_;
}

std::string HostAlarms::why(BoxAlarm kind) const {
  const std::lock_guard lock(mutex_);
  return newest_.why[alarm::index_of(kind)];
}

std::uint64_t HostAlarms::changes() const {
  const std::lock_guard lock(mutex_);
  return changes_;
}

std::uint64_t HostAlarms::write_changes(const alarm::BoxAlarms& before) {
  std::uint64_t ticket = 0;
  for (const BoxAlarm kind : alarm::kBoxAlarms) {
    const alarm::Alarm& alarm = alarms_.alarm(kind);
    const alarm::Alarm& was = before.alarm(kind);
    if (alarm.state() == was.state() &&
        !supervision::remembered_otherwise(was.memory(), alarm.memory())) {
      continue;
    }
    JournalEntry entry;
    entry.kind = JournalEntry::Kind::alarm;
    entry.utc_ms = utc_ms_();
    entry.loop = alarm::kBox;
    entry.alarm = alarm::to_text(kind);
    entry.from = alarm::to_text(was.state());
    entry.to = alarm::to_text(alarm.state());
    if (alarm.active()) entry.reason = newest_.why[alarm::index_of(kind)];
    entry.memory = alarm.memory();
    ticket = journal_.post(std::move(entry));
  }
  if (ticket != 0) ++changes_;
  return ticket;
}

}  // namespace loopwarden::daemon::host
