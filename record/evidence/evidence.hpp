// SPDX-License-Identifier: Apache-2.0
// Why an alarm was raised: the samples that raised it, and all that was found in them. They are a window that
// specialists judged, or the minutes or hours of a routine judgement.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "model/monitor/alarm_kind.hpp"
#include "model/monitor/loop_monitor.hpp"
#include "model/monitor/window.hpp"
#include "model/monitor/window_judge.hpp"
#include "model/monitor/window_measures.hpp"

namespace loopwarden::evidence {

struct Evidence {
  // --- the alarm ---
  std::string loop;
  loopwarden::monitor::AlarmKind alarm = loopwarden::monitor::AlarmKind::stiction;
  std::int64_t raised_ms = 0;  // UTC, ms since 1970
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
  // --- what was found: by routine evidence, or by specialists ---
  std::optional<loopwarden::monitor::RoutineWatch::Judgement> routine;
  loopwarden::monitor::WindowMeasures measures;  // with `judgement`, where there is no `routine`
  loopwarden::monitor::WindowJudgement judgement;
  // --- by whom ---
  std::string version;             // of the program
  std::uint32_t config_hash = 0;   // CRC-32 of the configuration files, as in the status
  std::string loop_file;           // as it was read
  std::string specialists_folder;  // as it was read; empty for routine evidence, as is the next
  std::uint32_t specialists_hash =
      0;  // CRC-32 of its manifest, which has the digests of all weights

  // Samples and findings of the step that `monitor` just made: of its window, or of its routine judgement.
  void take(const loopwarden::monitor::LoopMonitor& monitor,
            const loopwarden::monitor::MonitorStep& step, loopwarden::monitor::AlarmReason reason);
  // Valid as long as this is.
  loopwarden::monitor::Window window() const {
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
