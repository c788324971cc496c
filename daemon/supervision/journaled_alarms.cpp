// SPDX-License-Identifier: Apache-2.0
#include "daemon/supervision/journaled_alarms.hpp"

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

// Returns true if a repeated explanation of one alarm has no news for the journal.
bool same_name(const Explanation& before, const Explanation& now) {
  return before.raised_ms == now.raised_ms && before.effect == now.effect &&
         before.verdict == now.verdict;
}

// Changes between suppressed and normal get no line: a loop in manual would fill the journal.
bool worth_a_line(const alarm::AlarmTransition& t) noexcept {
  const auto quiet = [](AlarmState s) {
    return s == AlarmState::normal || s == AlarmState::suppressed;
  };
  return !(quiet(t.from) && quiet(t.to));
}

}  // namespace

JournaledAlarms::JournaledAlarms(SupervisedLoop loop, const alarm::AlarmSettings& settings,
                                 journal::Journal& journal, std::function<std::int64_t()> utc_ms)
    : name_(std::move(loop.name)),
      pv_unit_(std::move(loop.pv_unit)),
      journal_(journal),
      utc_ms_(std::move(utc_ms)),
      snapshot_(settings, loop.period_s) {
  for (const AlarmKind kind : loop.fitted) snapshot_.alarms.fit(kind);
  for (const auto& [kind, priority] : loop.priority) {
    snapshot_.priority[alarm::index_of(kind)] = priority;
  }
}

void JournaledAlarms::restore(const journal::AlarmStates& states) {
  const std::lock_guard lock(mutex_);
  for (const AlarmKind kind : alarm::kAlarmKinds) {
    const auto found = states.memories.find({name_, alarm::to_text(kind)});
    if (found != states.memories.end()) snapshot_.alarms.restore(kind, found->second);
  }
  const auto incident = states.incidents.find(name_);
  if (incident != states.incidents.end()) snapshot_.incident.restore(incident->second);
}

void JournaledAlarms::restore(const Explanation& explanation) {
  const std::lock_guard lock(mutex_);
  keep(explanation);
}

void JournaledAlarms::keep(const Explanation& explanation) {
  snapshot_.explanation = std::make_shared<const Explanation>(explanation);
  snapshot_.explanations[alarm::index_of(explanation.alarm)] = snapshot_.explanation;
}

void JournaledAlarms::take_measures(const alarm::WindowMeasures& measures) {
  snapshot_.measures = measures;
  snapshot_.stick_seen = alarm::shows_stick(measures) ||
                         (snapshot_.stick_seen && snapshot_.incident.incident().open());
}

bool JournaledAlarms::of_incident(const Explanation& explanation) const {
  return snapshot_.incident.incident().covers(explanation.raised_ms, now_ms());
}

std::vector<AlarmKind> JournaledAlarms::window_judged(const alarm::WindowMeasures& measures,
                                                      const alarm::WindowJudgement& judgement,
                                                      const alarm::AlarmConditions& conditions) {
  const std::lock_guard lock(mutex_);
  const Memories before = memories();
  ++snapshot_.windows;
  snapshot_.window_state = WindowState::valid;
  take_measures(measures);
  snapshot_.judgement = judgement;
  windows_.add(now_ms(), WindowState::valid, judgement);
  write_down(before, snapshot_.alarms.window_judged(now_ms(), conditions), {},
             "windows: they no longer show it");
  return raised_since(before);
}

std::vector<AlarmKind> JournaledAlarms::raised_since(const Memories& before) const {
  std::vector<AlarmKind> raised;
  for (const AlarmKind kind : alarm::kAlarmKinds) {
    const alarm::AlarmMemory& memory = snapshot_.alarms.alarm(kind).memory();
    if (memory.times_raised != before[alarm::index_of(kind)].times_raised) raised.push_back(kind);
  }
  return raised;
}

std::vector<AlarmKind> JournaledAlarms::routine_judged(
    const watch::RoutineWatch::Judgement& judgement, const alarm::AlarmConditions& conditions) {
  const std::lock_guard lock(mutex_);
  const Memories before = memories();
  snapshot_.source = judgement.source;
  snapshot_.sees_from_percent = judgement.sees_from_percent;
  const std::string why =
      fmt::format("routine: the last {:.0f} min, probability of a valve effect {:.2f}",
                  judgement.window_s / 60.0, judgement.probability);
  write_down(before, snapshot_.alarms.judged(now_ms(), conditions, alarm::AlarmReason::routine),
             why);
  return raised_since(before);
}

std::vector<AlarmKind> JournaledAlarms::twin_judged(const alarm::AlarmConditions& conditions) {
  const std::lock_guard lock(mutex_);
  const Memories before = memories();
  write_down(before, snapshot_.alarms.judged(now_ms(), conditions, alarm::AlarmReason::twin),
             "twin: what it predicts of PV no longer comes", "twin: PV comes as it predicts again");
  return raised_since(before);
}

void JournaledAlarms::process_changed(std::span<const ProcessNews> news) {
  const std::lock_guard lock(mutex_);
  const Memories before = memories();
  std::vector<alarm::ProcessChange> changes;
  for (const ProcessNews& one : news) changes.push_back(one.change);
  write_down(before, snapshot_.alarms.process_changed(now_ms(), changes), {}, {}, news);
}

void JournaledAlarms::deviation_rests(bool rests) {
  const std::lock_guard lock(mutex_);
  const Memories before = memories();
  write_down(before, snapshot_.alarms.deviation_rests(rests));
}

void JournaledAlarms::pv_lost(bool lost) {
  const std::lock_guard lock(mutex_);
  snapshot_.pv_lost = lost;
  const Memories before = memories();
  write_down(before, snapshot_.alarms.pv_lost(lost));
}

void JournaledAlarms::set_pv_silence(base::Reason reason) {
  const std::lock_guard lock(mutex_);
  if (reason == base::Reason::none) pv_back_ms_ = now_ms();
  snapshot_.pv_silence = reason;
}

void JournaledAlarms::behind_outage(std::string alarm) {
  const std::lock_guard lock(mutex_);
  const bool behind = !alarm.empty();
  const Memories before = memories();
  // A PV that is back and bad is the loop's own.
  if (!behind && !snapshot_.pv_lost && after_outage(before)) return;
  if (behind) snapshot_.outage = std::move(alarm);
  write_down(before, snapshot_.alarms.behind_outage(behind));
}

// Returns whether alarms that follow from an outage still clear. Raises those that don't.
bool JournaledAlarms::after_outage(const Memories& before) {
  const bool back = now_ms() - pv_back_ms_ >= alarm::AlarmLimits::kProcessDelay_ms;
  bool clears = false;
  for (const AlarmKind kind : alarm::kProcessAlarms) {
    if (!snapshot_.alarms.follows_outage(kind) || !snapshot_.alarms.alarm(kind).active()) continue;
    const bool own = back && there_[alarm::index_of(kind)];
    if (own) write_down(before, snapshot_.alarms.still_there(kind));
    clears = clears || !own;
  }
  return clears;
}

void JournaledAlarms::set_conditions(const alarm::ProcessWatch& process) {
  const std::lock_guard lock(mutex_);
  for (const AlarmKind kind : alarm::kProcessAlarms) {
    snapshot_.flaps[alarm::index_of(kind)] = process.flaps(kind);
    there_[alarm::index_of(kind)] = process.there(kind);
  }
}

void JournaledAlarms::explained(const Explanation& found) {
  const std::lock_guard lock(mutex_);
  Explanation explanation = found;
  // Without this effect the explanation does not rename the alarm.
  if (alarm::refuted(found.effect, snapshot_.stick_seen)) explanation.final_name.reset();
  const auto before_it = snapshot_.explanations[alarm::index_of(explanation.alarm)];
  keep(explanation);
  if (!before_it || !same_name(*before_it, explanation)) journal_explanation(explanation);
  write_incident(snapshot_.incident.explained(
      now_ms(), {.alarm = explanation.alarm,
                 .raised_ms = explanation.raised_ms,
                 .from_ms = std::isfinite(explanation.since_s)
                                ? explanation.raised_ms - std::llround(1000.0 * explanation.since_s)
                                : 0,
                 .effect = explanation.effect,
                 .block = explanation.block,
                 .confidence = explanation.confidence,
                 .gap_closed = explanation.gap_closed,
                 .stick_seen = snapshot_.stick_seen}));
  if (!of_incident(explanation)) return;
  const Memories before = memories();
  write_down(before,
             snapshot_.alarms.explained(
                 now_ms(), explanation.alarm, explanation.final_name.value_or(explanation.alarm),
                 std::isfinite(explanation.size_percent) ? explanation.size_percent : 0.0),
             fmt::format("explained: {}", explanation.sentence));
}

void JournaledAlarms::journal_explanation(const Explanation& explanation) {
  JournalEntry line;
  line.kind = JournalEntry::Kind::system;
  line.utc_ms = now_ms();
  line.loop = name_;
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

void JournaledAlarms::window_not_fit(const alarm::WindowMeasures& measures, WindowState why,
                                     const alarm::WindowJudgement& judgement) {
  const std::lock_guard lock(mutex_);
  ++snapshot_.windows;
  ++snapshot_.windows_suppressed;
  take_measures(measures);
  windows_.add(now_ms(), why, judgement);
  suppressed(why);
}

void JournaledAlarms::interrupted(WindowState why) {
  const std::lock_guard lock(mutex_);
  suppressed(why);
}

void JournaledAlarms::suppressed(WindowState why) {
  snapshot_.window_state = why;
  const Memories before = memories();
  write_down(before, snapshot_.alarms.window_not_valid());
}

void JournaledAlarms::set_progress(const watch::ModeTimes& times,
                                   const analysis::ConditionIndices& condition, WindowState state,
                                   const watch::RoutineWatch::Levels& routine) {
  const std::lock_guard lock(mutex_);
  snapshot_.times = times;
  snapshot_.condition = condition;
  snapshot_.routine = routine;
  if (state != WindowState::valid) snapshot_.window_state = state;
}

void JournaledAlarms::controller_not_watched(std::string why) {
  const std::lock_guard lock(mutex_);
  snapshot_.controller_not_watched = std::move(why);
}

void JournaledAlarms::set_twin_remarks(const watch::TwinRemarks& remarks, double passed_s) {
  using Kind = watch::TwinNews::Kind;
  const std::lock_guard lock(mutex_);
  snapshot_.twin = remarks;
  const std::optional<Kind> news = twin_news_.add(remarks, passed_s);
  if (!news) return;
  JournalEntry line;
  line.kind = JournalEntry::Kind::system;
  line.utc_ms = now_ms();
  line.loop = name_;
  line.what = "twin";
  line.result = "done";
  switch (*news) {
    case Kind::load_outside:
      line.new_value = fmt::format("load outside {:+.3g} {}", remarks.load->size, pv_unit_);
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

void JournaledAlarms::forget_stick() {
  const std::lock_guard lock(mutex_);
  snapshot_.measures.stick_percent = 0.0;
  snapshot_.measures.stick_source = alarm::StickSource::none;
}

void JournaledAlarms::pass_time() {
  const std::lock_guard lock(mutex_);
  if (snapshot_.incident.incident().open()) follow_incident();
  if (!snapshot_.alarms.any_shelved()) return;
  const Memories before = memories();
  write_down(before, snapshot_.alarms.pass_time(now_ms()));
}

alarm::Veto JournaledAlarms::veto() const {
  const std::lock_guard lock(mutex_);
  return snapshot_.veto;
}

JournaledAlarms::Sticks JournaledAlarms::sticks() const {
  const std::lock_guard lock(mutex_);
  const alarm::Alarm& alarm = snapshot_.alarms.alarm(AlarmKind::stiction);
  if (!alarm.active() || alarm.is_consequence()) return {};
  const auto& newest = snapshot_.explanation;
  const std::int64_t now_ms = utc_ms_();
  const std::int64_t raised_ms = alarm.memory().raised_ms;
  // An alarm with a time in the future was raised before the clock was set back.
  const bool since_alarm = newest && (newest->ended_ms >= raised_ms || raised_ms > now_ms);
  const bool holds = since_alarm && newest->stick && of_incident(*newest);
  return {true, holds ? newest : nullptr};
}

bool JournaledAlarms::take_begin_request() {
  const std::lock_guard lock(mutex_);
  return std::exchange(snapshot_.ordered, false);
}

void JournaledAlarms::set_corrective_state(alarm::CorrectiveState state) {
  const std::lock_guard lock(mutex_);
  snapshot_.corrective = state;
}

bool JournaledAlarms::stiction_is_on() const {
  const std::lock_guard lock(mutex_);
  const alarm::Alarm& alarm = snapshot_.alarms.alarm(AlarmKind::stiction);
  return alarm.active() && !alarm.is_consequence();
}

std::uint64_t JournaledAlarms::post(JournalEntry line) { return journal_.post(std::move(line)); }

AlarmSnapshot JournaledAlarms::snapshot() const {
  const std::lock_guard lock(mutex_);
  return snapshot_;
}

std::vector<LoggedWindow> JournaledAlarms::windows() const {
  const std::lock_guard lock(mutex_);
  return windows_.windows();
}

std::uint64_t JournaledAlarms::changes() const {
  const std::lock_guard lock(mutex_);
  return changes_;
}

JournaledAlarms::Memories JournaledAlarms::memories() const {
  Memories all;
  for (const AlarmKind kind : alarm::kAlarmKinds) {
    all[alarm::index_of(kind)] = snapshot_.alarms.alarm(kind).memory();
  }
  return all;
}

std::uint64_t JournaledAlarms::write_down(const Memories& before,
                                          const AlarmTransitions& transitions,
                                          const std::string& why, const std::string& why_gone,
                                          std::span<const ProcessNews> news) {
  std::uint64_t ticket = 0;
  for (const AlarmKind kind : alarm::kAlarmKinds) {
    const alarm::Alarm& alarm = snapshot_.alarms.alarm(kind);
    const alarm::AlarmMemory& was = before[alarm::index_of(kind)];
    JournalEntry entry;
    entry.kind = JournalEntry::Kind::alarm;
    entry.utc_ms = now_ms();
    entry.loop = name_;
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
    const auto cause = snapshot_.alarms.cause_of(kind);
    const bool outage = snapshot_.alarms.follows_outage(kind);
    if ((outage || cause) && alarm.active()) {
      entry.what = fmt::format("consequence of {}",
                               outage ? snapshot_.outage.c_str() : alarm::to_text(*cause));
    }
    if (!line && !remembered_otherwise(was, alarm.memory())) continue;
    if (!line) entry.from = entry.to = alarm::to_text(alarm.state());
    entry.memory = alarm.memory();
    ticket = journal_.post(std::move(entry));
  }
  if (ticket != 0 || !transitions.empty()) ++changes_;
  return std::max(ticket, follow_incident());
}

std::uint64_t JournaledAlarms::follow_incident() {
  return write_incident(snapshot_.incident.follow(now_ms(), snapshot_.alarms));
}

std::uint64_t JournaledAlarms::write_incident(const alarm::LoopIncident::Changes& changes) {
  std::uint64_t ticket = 0;
  const alarm::Incident& incident = snapshot_.incident.incident();
  for (const alarm::IncidentChange& change : changes) {
    JournalEntry entry;
    entry.kind = JournalEntry::Kind::system;
    entry.utc_ms = now_ms();
    entry.loop = name_;
    entry.what = fmt::format("incident {}", alarm::to_text(change.kind));
    using Kind = alarm::IncidentChange::Kind;
    if (change.kind == Kind::opened || change.kind == Kind::joined) {
      entry.alarm = alarm::to_text(change.alarm);
    }
    entry.old_value = change.from;
    entry.new_value = incident.name;
    entry.reason = journal::incident_id(name_, incident);
    entry.result = "done";
    entry.incident = incident;
    ticket = journal_.post(std::move(entry));
  }
  if (ticket != 0) ++changes_;
  return ticket;
}

}  // namespace loopwarden::daemon::supervision
