// SPDX-License-Identifier: Apache-2.0
#include "daemon/box/box_board.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace loopwarden::daemon::box {

namespace model = loopwarden::monitor;
using journal::JournalEntry;
using model::BoxAlarm;

void BoxBoard::restore(const journal::AlarmStates& states) {
  const std::lock_guard lock(mutex_);
  for (const BoxAlarm kind : model::kBoxAlarms) {
    const auto found = states.memories.find({model::kBox, model::to_text(kind)});
    if (found != states.memories.end()) alarms_.restore(kind, found->second);
  }
}

void BoxBoard::look(const BoxReport& report, std::int64_t monotonic_ms) {
  const std::lock_guard lock(mutex_);
  newest_ = report;
  const States before = states();
  if (alarms_.found(report.found, monotonic_ms, utc_ms_())) write_changes(before);
}

monitor::OrderResult BoxBoard::act(const BoxOrder& order) {
  const std::lock_guard lock(mutex_);
  return act_locked(order);
}

monitor::OrderResult BoxBoard::act_locked(const BoxOrder& order) {
  const States before = states();
  const std::int64_t now_ms = utc_ms_();
  monitor::OrderResult result;
  result.accepted = alarms_.act(order.kind, order.action, now_ms, now_ms + order.shelve_ms);
  if (!result.accepted) {
    result.why = fmt::format("alarm {} of the box is {}: nothing to {}", model::to_text(order.kind),
                             model::to_text(before[model::index_of(order.kind)]),
                             model::to_text(order.action));
  }
  JournalEntry entry;
  entry.kind = JournalEntry::Kind::operator_action;
  entry.utc_ms = now_ms;
  entry.loop = model::kBox;
  entry.alarm = model::to_text(order.kind);
  entry.peer = order.peer;
  entry.what = model::to_text(order.action);
  if (order.action == model::AlarmAction::shelve) {
    entry.new_value = fmt::format("{} min", order.shelve_ms / 60'000);
  }
  entry.reason = order.reason;
  entry.result = result.accepted ? "done" : "refused: " + result.why;
  entry.memory = alarms_.alarm(order.kind).memory();
  const std::uint64_t ordered = journal_.post(std::move(entry));
  const std::uint64_t changed = write_changes(before);
  if (result.accepted) result.ticket = std::max(ordered, changed);
  return result;
}

std::uint64_t BoxBoard::acknowledge_all(const std::string& peer, const std::string& reason) {
  const std::lock_guard lock(mutex_);
  std::uint64_t ticket = 0;
  for (const BoxAlarm kind : model::kBoxAlarms) {
    if (!alarms_.alarm(kind).unacknowledged()) continue;
    ticket = act_locked({kind, model::AlarmAction::acknowledge, 0, peer, reason}).ticket;
  }
  return ticket;
}

model::BoxAlarms BoxBoard::alarms() const {
  const std::lock_guard lock(mutex_);
  return alarms_;
}

std::string BoxBoard::why(BoxAlarm kind) const {
  const std::lock_guard lock(mutex_);
  return newest_.why[model::index_of(kind)];
}

BoxBoard::States BoxBoard::states() const {
  States now{};
  for (const BoxAlarm kind : model::kBoxAlarms) {
    now[model::index_of(kind)] = alarms_.alarm(kind).state();
  }
  return now;
}

std::uint64_t BoxBoard::write_changes(const States& before) {
  std::uint64_t ticket = 0;
  for (const BoxAlarm kind : model::kBoxAlarms) {
    const model::Alarm& alarm = alarms_.alarm(kind);
    const model::AlarmState was = before[model::index_of(kind)];
    if (alarm.state() == was) continue;
    JournalEntry entry;
    entry.kind = JournalEntry::Kind::alarm;
    entry.utc_ms = utc_ms_();
    entry.loop = model::kBox;
    entry.alarm = model::to_text(kind);
    entry.from = model::to_text(was);
    entry.to = model::to_text(alarm.state());
    if (alarm.active()) entry.reason = newest_.why[model::index_of(kind)];
    entry.memory = alarm.memory();
    ticket = journal_.post(std::move(entry));
  }
  return ticket;
}

}  // namespace loopwarden::daemon::box
