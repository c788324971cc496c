// SPDX-License-Identifier: Apache-2.0
// The evidence for an alarm: the samples that raised it, and all results of their evaluation. The
// samples are a window evaluated by specialists, the minutes or hours of a routine diagnosis, or
// the newest minutes compared with the loop's twin.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "model/alarm/alarm_kind.hpp"
#include "model/watch/loop_monitor.hpp"
#include "model/alarm/window.hpp"
#include "model/alarm/window_judge.hpp"
#include "model/alarm/window_measures.hpp"

namespace loopwarden::evidence {

// Final values of the twin's monitors, each above its limit.
struct TwinFinding {
  double change = 0.0;      // z of watch/twin_watch.hpp
  double controller = 0.0;  // S of watch/controller_watch.hpp; NaN: the controller was not
                            // monitored
};

struct Evidence {
  // --- the alarm ---
  std::string loop;
  bool elsewhere = false;  // another controller runs it
  alarm::AlarmKind alarm = alarm::AlarmKind::stiction;
  std::int64_t raised_ms = 0;    // UTC, ms since 1970
  std::uint64_t raised_at = 0;   // the loop's cycle; not saved in the file, nor is the next member
  std::int64_t incident_ms = 0;  // when its incident opened; 0: it is part of no incident
  // --- the samples as evaluated: decimated, missing cycles filled ---
  std::vector<double> sp;
  std::vector<double> pv;
  std::vector<double> co;
  std::vector<double> stem;  // NaN if there is no read-back; empty in routine evidence
  double sample_time_s = 0.1;
  double pv_low = 0.0;
  double pv_high = 100.0;
  double co_low = 0.0;
  double co_high = 100.0;
  // --- results: of routine evidence, of the twin, or of specialists ---
  std::optional<watch::RoutineWatch::Judgement> routine;
  std::optional<TwinFinding> by_twin;
  alarm::WindowMeasures measures;  // with `judgement`, if specialists made it
  alarm::WindowJudgement judgement;
  // --- versions and files used ---
  std::string version;             // of the program
  std::uint32_t config_hash = 0;   // CRC-32 of the configuration files, as in the status
  std::string loop_file;           // text as it was read
  std::string twin;                // the loop's twin as a file; empty: no twin
  std::string specialists_folder;  // text as it was read; this and the next: empty if no specialist
                                   // was used
  std::uint32_t specialists_hash =
      0;  // CRC-32 of its manifest, which has the digests of all weights

  // Takes samples and results of the step that `monitor` just made: of its window, or of its
  // routine diagnosis.
  void take(const watch::LoopMonitor& monitor, const watch::MonitorStep& step,
            alarm::AlarmReason reason);
  // Takes the result of the twin for the newest minutes.
  void take(const watch::LoopMonitor& monitor, numeric::LoopRecord minutes);
  bool by_specialists() const noexcept { return !routine && !by_twin; }
  // Returns a view that is valid while this object exists.
  alarm::Window window() const {
    return {{.period_s = sample_time_s,
             .pv = pv,
             .sp = sp,
             .co = co,
             .stem = stem,
             .pv_low = pv_low,
             .pv_high = pv_high,
             .co_low = co_low,
             .co_high = co_high},
            measures.bridged_cycles};
  }
};

}  // namespace loopwarden::evidence
