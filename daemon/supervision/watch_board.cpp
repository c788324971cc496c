// SPDX-License-Identifier: Apache-2.0
#include "daemon/supervision/watch_board.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "daemon/journal/incident_text.hpp"

namespace loopwarden::daemon::supervision {

using alarm::AlarmKind;
using alarm::AlarmState;
using alarm::AlarmTransitions;
using alarm::WindowState;
using journal::JournalEntry;

namespace {

void keep(LoopWatch& watch, const Explanation& explanation) {
  watch.explanation = std::make_shared<const Explanation>(explanation);
  watch.explanations[alarm::index_of(explanation.alarm)] = watch.explanation;
}

void take_measures(LoopWatch& watch, const alarm::WindowMeasures& measures) {
  watch.measures = measures;
  watch.stick_seen =
      alarm::shows_stick(measures) || (watch.stick_seen && watch.incident.incident().open());
}

// Not of an earlier one, whose explanation ended late.
bool of_incident(const LoopWatch& watch, const Explanation& explanation, std::int64_t now_ms) {
  return watch.incident.incident().covers(explanation.raised_ms, now_ms);
}

// Of one alarm, explained again: nothing new is told.
bool same_name(const Explanation& before, const Explanation& now) {
  return before.raised_ms == now.raised_ms && before.effect == now.effect &&
         before.verdict == now.verdict;
}

const char* what_of(const alarm::CorrectiveStep& step) noexcept {
  using Order = alarm::CorrectiveStep::Order;
  const bool planned = step.form == alarm::CorrectiveForm::planned_moves;
  switch (step.order) {
    case Order::on: return planned ? "planned moves on" : "jacket on";
    case Order::back: return planned ? "planned moves off" : "jacket back to shadow";
    case Order::shadow: return "planned moves in shadow";
    case Order::none: break;
  }
  return "corrective action";
}

// Suppressed and normal are one to the journal: a loop in manual would fill it.
bool worth_a_line(const alarm::AlarmTransition& t) noexcept {
  const auto quiet = [](AlarmState s) {
    return s == AlarmState::normal || s == AlarmState::suppressed;
  };
  return !(quiet(t.from) && quiet(t.to));
}

}  // namespace

WatchBoard::WatchBoard(std::vector<Loop> loops, const alarm::AlarmSettings& settings,
                       journal::Journal& journal, std::function<std::int64_t()> utc_ms)
    : settings_(settings), journal_(journal), utc_ms_(std::move(utc_ms)) {
  for (Loop& loop : loops) {
    LoopWatch& watch = watches_.emplace_back(settings, loop.period_s);
    for (const AlarmKind kind : loop.fitted) watch.alarms.fit(kind);
    for (const auto& [kind, priority] : loop.priority) {
      watch.priority[alarm::index_of(kind)] = priority;
    }
    logs_.emplace_back();
    twin_news_.emplace_back();
    names_.push_back(std::move(loop.name));
    pv_units_.push_back(std::move(loop.pv_unit));
  }
}

void WatchBoard::restore(const journal::AlarmStates& states) {
  const std::lock_guard lock(mutex_);
  for (std::size_t i = 0; i < names_.size(); ++i) {
    for (const AlarmKind kind : alarm::kAlarmKinds) {
      const auto found = states.memories.find({names_[i], alarm::to_text(kind)});
      if (found != states.memories.end()) watches_[i].alarms.restore(kind, found->second);
    }
    const auto incident = states.incidents.find(names_[i]);
    if (incident != states.incidents.end()) watches_[i].incident.restore(incident->second);
  }
}

std::vector<AlarmKind> WatchBoard::window_judged(std::size_t loop,
                                                 const alarm::WindowMeasures& measures,
                                                 const alarm::WindowJudgement& judgement,
                                                 const alarm::AlarmConditions& conditions) {
  const std::lock_guard lock(mutex_);
  LoopWatch& watch = watches_[loop];
  const Memories before = memories(loop);
  ++watch.windows;
  watch.window_state = WindowState::valid;
  take_measures(watch, measures);
  watch.judgement = judgement;
  logs_[loop].add(utc_ms_(), WindowState::valid, judgement);
  write_down(loop, before, watch.alarms.window_judged(utc_ms_(), conditions), {},
             "windows: they no longer show it");
  return raised_since(loop, before);
}

std::vector<AlarmKind> WatchBoard::raised_since(std::size_t loop, const Memories& before) const {
  std::vector<AlarmKind> raised;
  for (const AlarmKind kind : alarm::kAlarmKinds) {
    const alarm::AlarmMemory& memory = watches_[loop].alarms.alarm(kind).memory();
    if (memory.times_raised != before[alarm::index_of(kind)].times_raised) raised.push_back(kind);
  }
  return raised;
}

std::vector<AlarmKind> WatchBoard::routine_judged(std::size_t loop,
                                                  const watch::RoutineWatch::Judgement& judgement,
                                                  const alarm::AlarmConditions& conditions) {
  const std::lock_guard lock(mutex_);
  const Memories before = memories(loop);
  watches_[loop].source = judgement.source;
  watches_[loop].sees_from_percent = judgement.sees_from_percent;
  const std::string why =
      fmt::format("routine: the last {:.0f} min, probability of a valve effect {:.2f}",
                  judgement.window_s / 60.0, judgement.probability);
  write_down(loop, before,
             watches_[loop].alarms.judged(utc_ms_(), conditions, alarm::AlarmReason::routine), why);
  return raised_since(loop, before);
}

std::vector<AlarmKind> WatchBoard::twin_judged(std::size_t loop,
                                               const alarm::AlarmConditions& conditions) {
  const std::lock_guard lock(mutex_);
  const Memories before = memories(loop);
  write_down(loop, before,
             watches_[loop].alarms.judged(utc_ms_(), conditions, alarm::AlarmReason::twin),
             "twin: what it predicts of PV no longer comes", "twin: PV comes as it predicts again");
  return raised_since(loop, before);
}

void WatchBoard::process_changed(std::size_t loop, std::span<const ProcessNews> news) {
  const std::lock_guard lock(mutex_);
  const Memories before = memories(loop);
  std::vector<alarm::ProcessChange> changes;
  for (const ProcessNews& one : news) changes.push_back(one.change);
  write_down(loop, before, watches_[loop].alarms.process_changed(utc_ms_(), changes), {}, {}, news);
}

void WatchBoard::deviation_rests(std::size_t loop, bool rests) {
  const std::lock_guard lock(mutex_);
  const Memories before = memories(loop);
  write_down(loop, before, watches_[loop].alarms.deviation_rests(rests));
}

void WatchBoard::pv_lost(std::size_t loop, bool lost) {
  const std::lock_guard lock(mutex_);
  const Memories before = memories(loop);
  write_down(loop, before, watches_[loop].alarms.pv_lost(lost));
}

void WatchBoard::set_flaps(std::size_t loop, const alarm::ProcessWatch& process) {
  const std::lock_guard lock(mutex_);
  for (const AlarmKind kind : alarm::kProcessAlarms) {
    watches_[loop].flaps[alarm::index_of(kind)] = process.flaps(kind);
  }
}

void WatchBoard::explained(std::size_t loop, const Explanation& found) {
  const std::lock_guard lock(mutex_);
  LoopWatch& watch = watches_[loop];
  Explanation explanation = found;
  // Whether its name is sure was decided where the final name was given.
  if (alarm::refuted(found.effect, watch.stick_seen)) explanation.final_name.reset();
  const auto before_it = watch.explanations[alarm::index_of(explanation.alarm)];
  keep(watch, explanation);
  if (!before_it || !same_name(*before_it, explanation)) tell_explanation(loop, explanation);
  write_incident(
      loop, watch.incident.explained(
                utc_ms_(),
                {.alarm = explanation.alarm,
                 .raised_ms = explanation.raised_ms,
                 .from_ms = std::isfinite(explanation.since_s)
                                ? explanation.raised_ms - std::llround(1000.0 * explanation.since_s)
                                : 0,
                 .effect = explanation.effect,
                 .block = explanation.block,
                 .confidence = explanation.confidence,
                 .gap_closed = explanation.gap_closed,
                 .stick_seen = watch.stick_seen}));
  if (!of_incident(watch, explanation, utc_ms_())) return;
  const Memories before = memories(loop);
  write_down(loop, before,
             watch.alarms.explained(
                 utc_ms_(), explanation.alarm, explanation.final_name.value_or(explanation.alarm),
                 std::isfinite(explanation.size_percent) ? explanation.size_percent : 0.0),
             fmt::format("explained: {}", explanation.sentence));
}

void WatchBoard::tell_explanation(std::size_t loop, const Explanation& explanation) {
  JournalEntry line;
  line.kind = JournalEntry::Kind::system;
  line.utc_ms = utc_ms_();
  line.loop = names_[loop];
  line.alarm = alarm::to_text(explanation.alarm);
  line.what = "explanation";
  line.new_value = explanation.effect.empty() ? explanation.verdict : explanation.effect;
  if (std::isfinite(explanation.size_percent)) {
    line.new_value += fmt::format(" {:.1f} % of span", explanation.size_percent);
  }
  line.reason = explanation.sentence;
  if (std::isfinite(explanation.gap_closed)) {
    line.reason += fmt::format(" {:.0f} % of the gap closed.", 100.0 * explanation.gap_closed);
  }
  line.result = explanation.agrees ? "agrees" : "does not agree";
  journal_.post(std::move(line));
}

void WatchBoard::restore(std::size_t loop, const Explanation& explanation) {
  const std::lock_guard lock(mutex_);
  keep(watches_[loop], explanation);
}

void WatchBoard::window_not_fit(std::size_t loop, const alarm::WindowMeasures& measures,
                                WindowState why, const alarm::WindowJudgement& judgement) {
  const std::lock_guard lock(mutex_);
  LoopWatch& watch = watches_[loop];
  ++watch.windows;
  ++watch.windows_suppressed;
  take_measures(watch, measures);
  logs_[loop].add(utc_ms_(), why, judgement);
  suppressed(loop, why);
}

void WatchBoard::interrupted(std::size_t loop, WindowState why) {
  const std::lock_guard lock(mutex_);
  suppressed(loop, why);
}

void WatchBoard::suppressed(std::size_t loop, WindowState why) {
  LoopWatch& watch = watches_[loop];
  watch.window_state = why;
  const Memories before = memories(loop);
  write_down(loop, before, watch.alarms.window_not_valid());
}

void WatchBoard::set_progress(std::size_t loop, const watch::ModeTimes& times,
                              const analysis::ConditionIndices& condition, WindowState state,
                              const watch::RoutineWatch::Levels& routine) {
  const std::lock_guard lock(mutex_);
  watches_[loop].times = times;
  watches_[loop].condition = condition;
  watches_[loop].routine = routine;
  if (state != WindowState::valid) watches_[loop].window_state = state;
}

void WatchBoard::controller_not_watched(std::size_t loop, std::string why) {
  const std::lock_guard lock(mutex_);
  watches_[loop].controller_not_watched = std::move(why);
}

void WatchBoard::twin_says(std::size_t loop, const watch::TwinRemarks& remarks, double passed_s) {
  using Kind = watch::TwinNews::Kind;
  const std::lock_guard lock(mutex_);
  watches_[loop].twin = remarks;
  const std::optional<Kind> news = twin_news_[loop].add(remarks, passed_s);
  if (!news) return;
  JournalEntry line;
  line.kind = JournalEntry::Kind::system;
  line.utc_ms = utc_ms_();
  line.loop = names_[loop];
  line.what = "twin";
  line.result = "done";
  switch (*news) {
    case Kind::load_outside:
      line.new_value = fmt::format("load outside {:+.3g} {}", remarks.load->size, pv_units_[loop]);
      line.reason = "a load that the healthy record does not show; no alarm";
      break;
    case Kind::load_back: line.new_value = "load back"; break;
    case Kind::not_judged:
      line.new_value = "not judged here";
      line.reason = remarks.judging == watch::Judging::outside
                        ? "PV or CO is where the healthy record never was"
                        : "PV and CO don't stay long enough where the healthy record was";
      break;
    case Kind::judged_again: line.new_value = "judged again"; break;
  }
  journal_.post(std::move(line));
}

void WatchBoard::stick_not_known(std::size_t loop) {
  const std::lock_guard lock(mutex_);
  watches_[loop].measures.stick_percent = 0.0;
  watches_[loop].measures.stick_source = alarm::StickSource::none;
}

void WatchBoard::pass_time() {
  const std::lock_guard lock(mutex_);
  for (std::size_t i = 0; i < watches_.size(); ++i) {
    if (watches_[i].incident.incident().open()) follow_incident(i);
    if (!watches_[i].alarms.any_shelved()) continue;
    const Memories before = memories(i);
    write_down(i, before, watches_[i].alarms.pass_time(utc_ms_()));
  }
}

alarm::Veto WatchBoard::veto(std::size_t loop) const {
  const std::lock_guard lock(mutex_);
  return watches_[loop].veto;
}

WatchBoard::Sticks WatchBoard::sticks(std::size_t loop) const {
  const std::lock_guard lock(mutex_);
  const LoopWatch& watch = watches_[loop];
  const alarm::Alarm& alarm = watch.alarms.alarm(AlarmKind::stiction);
  if (!alarm.active() || alarm.is_consequence()) return {};
  const auto& newest = watch.explanation;
  const std::int64_t now_ms = utc_ms_();
  const std::int64_t raised_ms = alarm.memory().raised_ms;
  // An alarm with a time in the future was raised before the clock was set back.
  const bool since_alarm = newest && (newest->ended_ms >= raised_ms || raised_ms > now_ms);
  const bool holds = since_alarm && newest->stick && of_incident(watch, *newest, now_ms);
  return {true, holds ? newest : nullptr};
}

bool WatchBoard::take_order(std::size_t loop) {
  const std::lock_guard lock(mutex_);
  return std::exchange(watches_[loop].ordered, false);
}

void WatchBoard::corrective_state(std::size_t loop, alarm::CorrectiveState state) {
  const std::lock_guard lock(mutex_);
  watches_[loop].corrective = state;
}

JournalEntry WatchBoard::corrective_step(std::size_t loop, const alarm::CorrectiveStep& step) {
  const std::lock_guard lock(mutex_);
  watches_[loop].corrective = step.to;
  JournalEntry entry;
  entry.kind = JournalEntry::Kind::system;
  entry.utc_ms = utc_ms_();
  entry.loop = names_[loop];
  entry.alarm = alarm::to_text(AlarmKind::stiction);
  entry.what = what_of(step);
  entry.old_value = alarm::to_text(step.from);
  entry.new_value = alarm::to_text(step.to);
  entry.reason = step.why;
  if (step.rms_before > 0.0) {
    entry.reason += fmt::format("; % of PV span, before: rms {:.3g}, mean {:.3g}", step.rms_before,
                                step.mean_before);
  }
  if (step.rms_after > 0.0) {
    entry.reason +=
        fmt::format("; after: rms {:.3g}, mean {:.3g}", step.rms_after, step.mean_after);
  }
  if (step.gain_in_shadow > 0.0) {
    entry.reason += fmt::format("; in shadow: rms {:.2f} of that without", step.gain_in_shadow);
  }
  return entry;
}

void WatchBoard::write_down(JournalEntry line) {
  line.result = "done";
  journal_.post(std::move(line));
}

LoopWatch WatchBoard::watch(std::size_t loop) const {
  const std::lock_guard lock(mutex_);
  return watches_[loop];
}

std::vector<LoggedWindow> WatchBoard::windows(std::size_t loop) const {
  const std::lock_guard lock(mutex_);
  return logs_[loop].windows();
}

std::uint64_t WatchBoard::alarm_changes() const {
  const std::lock_guard lock(mutex_);
  return alarm_changes_;
}

WatchBoard::Memories WatchBoard::memories(std::size_t loop) const {
  Memories all;
  for (const AlarmKind kind : alarm::kAlarmKinds) {
    all[alarm::index_of(kind)] = watches_[loop].alarms.alarm(kind).memory();
  }
  return all;
}

std::uint64_t WatchBoard::write_down(std::size_t loop, const Memories& before,
                                     const AlarmTransitions& transitions, const std::string& why,
                                     const std::string& why_gone,
                                     std::span<const ProcessNews> news) {
  std::uint64_t ticket = 0;
  for (const AlarmKind kind : alarm::kAlarmKinds) {
    const alarm::Alarm& alarm = watches_[loop].alarms.alarm(kind);
    const alarm::AlarmMemory& was = before[alarm::index_of(kind)];
    JournalEntry entry;
    entry.kind = JournalEntry::Kind::alarm;
    entry.utc_ms = utc_ms_();
    entry.loop = names_[loop];
    entry.alarm = alarm::to_text(kind);
    bool line = false;
    for (const alarm::AlarmTransition& t : transitions.view()) {
      if (t.kind != kind || !worth_a_line(t)) continue;
      line = true;
      entry.from = alarm::to_text(t.from);
      entry.to = alarm::to_text(t.to);
      if (alarm::has_size(kind)) entry.severity_percent = t.severity_percent;
      const bool gone = !alarm.active() && !why_gone.empty();
      entry.reason = gone ? why_gone : why;
      if (t.from == AlarmState::suppressed && !news.empty()) {
        entry.reason = "what it followed from has gone";
      }
    }
    for (const ProcessNews& one : news) {
      if (one.change.kind == kind) entry.reason = one.why;
    }
    const auto cause = watches_[loop].alarms.cause_of(kind);
    if (cause && alarm.active())
      entry.what = fmt::format("consequence of {}", alarm::to_text(*cause));
    if (!line && !remembered_otherwise(was, alarm.memory())) continue;
    if (!line) entry.from = entry.to = alarm::to_text(alarm.state());
    entry.memory = alarm.memory();
    ticket = journal_.post(std::move(entry));
  }
  if (ticket != 0 || !transitions.empty()) ++alarm_changes_;
  return std::max(ticket, follow_incident(loop));
}

std::uint64_t WatchBoard::follow_incident(std::size_t loop) {
  LoopWatch& watch = watches_[loop];
  return write_incident(loop, watch.incident.follow(utc_ms_(), watch.alarms));
}

std::uint64_t WatchBoard::write_incident(std::size_t loop,
                                         const alarm::LoopIncident::Changes& changes) {
  std::uint64_t ticket = 0;
  const alarm::Incident& incident = watches_[loop].incident.incident();
  for (const alarm::IncidentChange& change : changes) {
    JournalEntry entry;
    entry.kind = JournalEntry::Kind::system;
    entry.utc_ms = utc_ms_();
    entry.loop = names_[loop];
    entry.what = fmt::format("incident {}", alarm::to_text(change.kind));
    using Kind = alarm::IncidentChange::Kind;
    if (change.kind == Kind::opened || change.kind == Kind::joined) {
      entry.alarm = alarm::to_text(change.alarm);
    }
    entry.old_value = change.from;
    entry.new_value = incident.name;
    entry.reason = journal::incident_id(names_[loop], incident);
    entry.result = "done";
    entry.incident = incident;
    ticket = journal_.post(std::move(entry));
  }
  if (ticket != 0) ++alarm_changes_;
  return ticket;
}

}  // namespace loopwarden::daemon::supervision
