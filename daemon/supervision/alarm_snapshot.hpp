// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "daemon/supervision/explanation.hpp"
#include "model/analysis/condition_index.hpp"
#include "model/alarm/corrective_action.hpp"
#include "model/alarm/loop_alarms.hpp"
#include "model/alarm/loop_incident.hpp"
#include "base/quality.hpp"
#include "model/watch/mode_times.hpp"
#include "model/watch/routine_watch.hpp"
#include "model/watch/twin_remarks.hpp"
#include "model/alarm/window_judge.hpp"
#include "model/alarm/window_measures.hpp"

namespace loopwarden::daemon::supervision {

// State of the supervision of one loop at one moment.
struct AlarmSnapshot {
  AlarmSnapshot(const alarm::AlarmSettings& settings, double period_s) noexcept
      : alarms(settings), times(period_s) {
    for (const alarm::AlarmKind kind : alarm::kAlarmKinds) {
      priority[index_of(kind)] = usual_priority(kind);
    }
  }

  alarm::LoopAlarms alarms;
  std::array<alarm::Priority, alarm::kAlarmKindCount> priority{};
  // Repetitions of the condition of each process alarm since it was last quiet.
  std::array<std::uint32_t, alarm::kAlarmKindCount> flaps{};
  alarm::LoopIncident incident;
  alarm::WindowState window_state = alarm::WindowState::filling;
  std::uint32_t windows = 0;             // full windows since the start
  std::uint32_t windows_suppressed = 0;  // full windows that could not be judged
  alarm::WindowMeasures measures;        // of the newest window
  bool stick_seen = false;               // in the read-back, since the incident opened
  alarm::WindowJudgement judgement;      // of the newest judged window
  watch::ModeTimes times;
  analysis::ConditionIndices condition;
  alarm::CorrectiveState corrective = alarm::CorrectiveState::off;
  alarm::Veto veto = alarm::Veto::none;  // of the operator
  bool ordered = false;  // an operator began the offered action; until the supervisor takes it
  // Newest explanation per alarm, by the name under which it was raised, and newest of all.
  std::array<std::shared_ptr<const Explanation>, alarm::kAlarmKindCount> explanations;
  std::shared_ptr<const Explanation> explanation;
  // Findings of the twin without an alarm; set if the loop has a twin.
  std::optional<watch::TwinRemarks> twin;
  // Why the twin does not watch the controller; empty if it does, or if the loop runs here.
  std::string controller_not_watched;
  // Compression of PV and CO by the source, from the newest routine judgement.
  diagnosis::Archived source;
  double sees_from_percent = 0.0;                // % of the CO span
  base::Reason pv_silence = base::Reason::none;  // why PV does not arrive; none: it arrives
  bool pv_lost = false;                          // bad or silent, by the newest cycle
  std::string outage;  // the box's alarm that stands for the silence; empty: there is none
  watch::RoutineWatch::Levels routine{};
};

}  // namespace loopwarden::daemon::supervision
