// SPDX-License-Identifier: Apache-2.0
#include "daemon/supervision/loop_supervisor.hpp"

#include <algorithm>
#include <utility>

#include "daemon/supervision/row_text.hpp"

namespace loopwarden::daemon::supervision {

using record::RecordRow;

namespace {

watch::Cycle cycle_of(const RecordRow& row) {
  return {.period_index = row.period_index,
          .sp = row.sp,
          .pv = row.pv,
          .co = row.co,
          .stem = row.stem,
          .automatic = row.mode == control::Mode::automatic,
          .pv_good = row.pv_quality == base::Quality::good};
}

bool is_frozen(const RecordRow& row) { return row.pv_reason == base::Reason::frozen; }

bool is_silence(base::Reason reason) {
  switch (reason) {
    case base::Reason::never_received:
    case base::Reason::stale:
    case base::Reason::link_lost:
    case base::Reason::source_silent:
    case base::Reason::source_dead: return true;
    default: return false;
  }
}

alarm::ProcessCycle process_cycle_of(const RecordRow& row) {
  const base::Quality quality = row.pv_quality;
  return {.period_index = row.period_index,
          .sp = row.sp,
          .pv = row.pv,
          .pv_good = quality == base::Quality::good,
          .pv_bad = quality == base::Quality::bad,
          .pv_frozen = is_frozen(row),
          .pv_silent = quality == base::Quality::bad && is_silence(row.pv_reason),
          .output_arrives = (row.flags & record::kOutputLost) == 0,
          .out_of_service = (row.flags & record::kOutOfService) != 0,
          .fault = row.fault,
          .mode = row.mode,
          .requested_mode = row.requested_mode};
}

}  // namespace

void LoopSupervisor::watch(const MonitoredLoop& loop, Raised raised) {
  cycles_ = loop.cycles;
  raised_ = std::move(raised);
  detectors_ = std::make_unique<Detectors>(loop);
  history_ = loop.twin == nullptr
                 ? nullptr
                 : std::make_unique<History>(loop.history_s, loop.twin->sample_time_s);
  corrective_ = std::make_unique<CorrectiveControl>(loop.corrective, loop.channels, loop.twin,
                                                    loop.window.sample_time_s, alarms_);
  if (loop.loop != nullptr) {
    moves_.emplace(*loop.loop, loop.window.sample_time_s, loop.moves_lease);
  }
  if (const watch::ControllerWatch* controller = detectors_->monitor.controller()) {
    alarms_.controller_not_watched(controller->why_not());
  }
  restore_detectors();
}

void LoopSupervisor::restore_detectors() {
  const AlarmSnapshot known = alarms_.snapshot();
  for (const alarm::AlarmKind kind : alarm::kAlarmKinds) {
    const alarm::Alarm& alarm = known.alarms.alarm(kind);
    if (alarm::is_process_alarm(kind)) {
      detectors_->process.restore(kind, alarm.active());
    } else {
      detectors_->monitor.restore(kind, alarm.active(), alarm.memory().severity_percent);
    }
  }
}

LoopSupervisor::Turn LoopSupervisor::take_turn() {
  if (moves_) moves_->take_turn();
  corrective_->attend();
  detectors_->monitor.calm(corrective_->suppresses_cycling());
  Turn turn;
  bool judged = false;
  RecordRow row;
  while (turn.cycles < kCyclesATurn && !judged && cycles_->try_pop(row)) {
    ++turn.cycles;
    const watch::MonitorStep result = step(row);
    judged = use_window(result);
    if (judged) ++turn.windows;
    if (result.twin) {
      report_raised(alarms_.twin_judged(result.conditions), result, alarm::AlarmReason::twin);
    }
    if (result.routine) {
      report_raised(alarms_.routine_judged(*result.routine, result.conditions), result,
                    alarm::AlarmReason::routine);
      judged = true;  // it took as long as a window
    }
  }
  if (turn.cycles > 0) publish_progress(turn.cycles);
  turn.more = turn.cycles > 0 && (judged || turn.cycles == kCyclesATurn);
  return turn;
}

watch::MonitorStep LoopSupervisor::step(const RecordRow& row) {
  Detectors& d = *detectors_;
  const bool at_limit = (row.flags & (record::kAtLow | record::kAtHigh)) != 0;
  d.times.add(row.mode, at_limit);
  watch_process(row);
  const watch::Cycle cycle = cycle_of(row);
  d.condition.add(cycle,
                  {.pv_bad = row.pv_quality == base::Quality::bad,
                   .pv_frozen = is_frozen(row),
                   .cycle_bad = (row.flags & (record::kLateCycle | record::kOutputLost)) != 0});
  watch::MonitorStep result = d.monitor.add(cycle);
  if (history_) {
    history_->add(cycle);
    if (d.monitor.twin_quiet()) history_->quiet();
  }
  if ((result.twin || result.routine) && d.condition.verdict(result.conditions)) {
    alarms_.forget_stick();
  }
  return result;
}

void LoopSupervisor::watch_process(const RecordRow& row) {
  Detectors& d = *detectors_;
  alarm::ProcessCycle cycle = process_cycle_of(row);
  cycle.pv_awaited = d.foreign_controller && row.pv_reason == base::Reason::never_received;
  if (const base::Reason silence = cycle.pv_silent ? row.pv_reason : base::Reason::none;
      silence != d.pv_silence) {
    alarms_.set_pv_silence(silence);
    d.pv_silence = silence;
  }
  const alarm::ProcessChanges changes = d.process.add(cycle);
  // First, because other changes of the same cycle may follow from it.
  if (const bool lost = d.process.pv_lost(); lost != d.pv_lost) {
    alarms_.pv_lost(lost);
    d.pv_lost = lost;
  }
  if (!changes.view().empty()) {
    std::vector<ProcessNews> news;
    for (const alarm::ProcessChange& change : changes.view()) {
      news.push_back({change, why_changed(change, row, d.process_settings, d.pv_unit)});
    }
    alarms_.process_changed(news);
  }
  const bool rests = d.process.deviation_rests();
  if (rests != d.deviation_rests && d.process_settings.at(alarm::AlarmKind::deviation).fitted) {
    alarms_.deviation_rests(rests);
    d.deviation_rests = rests;
  }
}

bool LoopSupervisor::use_window(const watch::MonitorStep& step) {
  using Kind = watch::MonitorStep::Kind;
  watch::ConditionWatch& condition = detectors_->condition;
  switch (step.kind) {
    case Kind::nothing: return false;
    case Kind::interrupted:
      alarms_.interrupted(step.state);
      corrective_->follow_step(step, false);
      return false;
    case Kind::not_fit:
      condition.window(step.measures, nullptr);
      alarms_.window_not_fit(condition.told(step.measures), step.state, step.judgement);
      corrective_->follow_step(step, false);
      break;
    case Kind::judged: {
      condition.window(step.measures, &step.conditions);
      const JournaledAlarms::AlarmKinds raised =
          alarms_.window_judged(condition.told(step.measures), step.judgement, step.conditions);
      report_raised(raised, step, alarm::AlarmReason::windows);
      corrective_->follow_step(step, std::find(raised.begin(), raised.end(),
                                               alarm::AlarmKind::stiction) != raised.end());
      break;
    }
  }
  return true;
}

void LoopSupervisor::report_raised(const JournaledAlarms::AlarmKinds& alarms,
                                   const watch::MonitorStep& step, alarm::AlarmReason reason) {
  if (!raised_) return;
  for (const alarm::AlarmKind alarm : alarms) {
    raised_(index_, alarm, detectors_->monitor, step, reason);
  }
}

void LoopSupervisor::publish_progress(std::size_t cycles) {
  Detectors& d = *detectors_;
  corrective_->follow_moves(cycles);
  if (const auto remarks = d.monitor.remarks()) {
    alarms_.set_twin_remarks(*remarks,
                             d.monitor.settings().sample_time_s * static_cast<double>(cycles));
  }
  alarms_.set_progress(d.times, d.condition.indices(), d.monitor.state(),
                       d.monitor.routine_levels());
  alarms_.set_conditions(d.process);
}

}  // namespace loopwarden::daemon::supervision
