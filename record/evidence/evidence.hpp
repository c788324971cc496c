// SPDX-License-Identifier: Apache-2.0
// Why an alarm was raised: the samples that raised it, and all that was found in them. They are a window that
// specialists judged, the minutes or hours of a routine judgement, or the newest minutes beside the loop's twin.
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

// What the watches of a twin held in the end, each over its limit.
struct TwinFinding {
  double change = 0.0;      // z of monitor/twin_watch.hpp
  double controller = 0.0;  // S of monitor/controller_watch.hpp; NaN: nobody watched it
};

struct Evidence {
  // --- the alarm ---
  std::string loop;
  bool elsewhere = false;  // another controller has it
  alarm::AlarmKind alarm = alarm::AlarmKind::stiction;
  std::int64_t raised_ms = 0;   // UTC, ms since 1970
  std::uint64_t raised_at = 0;  // the loop's cycle; not in the file, as is the next
  std::int64_t incident_ms =
      0;  // when the incident that it belongs to opened; 0: it belongs to none
  // --- the samples, as they were judged: decimated, missing cycles stood in for ---
  std::vector<double> sp;
  std::vector<double> pv;
  std::vector<double> co;
  std::vector<double> stem;  // NaN where there is no read-back; routine evidence has none
  double sample_time_s = 0.1;
  double pv_low = 0.0;
  double pv_high = 100.0;
  double co_low = 0.0;
  double co_high = 100.0;
  // --- what was found: by routine evidence, by the twin, or by specialists ---
  std::optional<watch::RoutineWatch::Judgement> routine;
  std::optional<TwinFinding> by_twin;
  alarm::WindowMeasures measures;  // with `judgement`, where specialists found it
  alarm::WindowJudgement judgement;
  // --- by whom ---
  std::string version;             // of the program
  std::uint32_t config_hash = 0;   // CRC-32 of the configuration files, as in the status
  std::string loop_file;           // as it was read
  std::string twin;                // the loop's, as a file; empty: it has none
  std::string specialists_folder;  // as it was read; empty where none found it, as is the next
  std::uint32_t specialists_hash =
      0;  // CRC-32 of its manifest, which has the digests of all weights

  // Samples and findings of the step that `monitor` just made: of its window, or of its routine judgement.
  void take(const watch::LoopMonitor& monitor,
            const watch::MonitorStep& step, alarm::AlarmReason reason);
  // What the twin found in the newest minutes.
  void take(const watch::LoopMonitor& monitor, std::vector<double> minutes_sp,
            std::vector<double> minutes_pv, std::vector<double> minutes_co);
  bool by_specialists() const noexcept { return !routine && !by_twin; }
  // Valid as long as this is.
  alarm::Window window() const {
    return {.sp = sp,
            .pv = pv,
            .co = co,
            .stem = stem,
            .sample_time_s = sample_time_s,
            .pv_low = pv_low,
            .pv_high = pv_high,
            .co_low = co_low,
            .co_high = co_high,
            .bridged_cycles = measures.bridged_cycles};
  }
};

}  // namespace loopwarden::evidence
