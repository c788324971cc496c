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
  for (std::size_t i = 0; i < about_.size(); ++i) {
    if (!report.why.at(i).empty()) about_.at(i) = report.why.at(i);
  }
  const alarm::BoxAlarms before = alarms_;
  const bool changed = alarms_.found(report.found, monotonic_ms, utc_ms_());
  if (raise_for_new_connections() || changed) write_changes(before);
}

bool HostAlarms::raise_for_new_connections() {
  const std::vector<std::string>& lost = newest_.lost_connections;
  const alarm::Alarm& alarm = alarms_.alarm(BoxAlarm::connection_lost);
  const auto is_new = [this](const std::string& one) {
    return std::find(raised_for_.begin(), raised_for_.end(), one) == raised_for_.end();
  };
  const bool again = !raised_for_.empty() && std::any_of(lost.begin(), lost.end(), is_new);
  if (again) alarms_.raise_again(BoxAlarm::connection_lost, utc_ms_());
  if (!alarm.active()) {
    raised_for_.clear();
  } else if (raised_for_.empty() || again) {
    raised_for_ = lost;
  }
  return again;
}

alarm::Priority HostAlarms::priority(BoxAlarm kind) const {
  const std::lock_guard lock(mutex_);
  const bool output = kind == BoxAlarm::connection_lost && newest_.output_behind;
  return output ? alarm::Priority::critical : alarm::usual_priority(kind);
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

std::string HostAlarms::about(BoxAlarm kind) const {
  const std::lock_guard lock(mutex_);
  const bool shown = alarms_.alarm(kind).state() != alarm::AlarmState::normal;
  return shown ? about_.at(alarm::index_of(kind)) : std::string();
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
