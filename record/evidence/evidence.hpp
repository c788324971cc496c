// SPDX-License-Identifier: Apache-2.0
// Why an alarm was raised: the window that raised it, and all that was found in it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "model/monitor/alarm_kind.hpp"
#include "model/monitor/window.hpp"
#include "model/monitor/window_judge.hpp"
#include "model/monitor/window_measures.hpp"

namespace loopwarden::evidence {

struct Evidence {
  // --- the alarm ---
  std::string loop;
  loopwarden::monitor::AlarmKind alarm = loopwarden::monitor::AlarmKind::stiction;
  std::int64_t raised_ms = 0;  // UTC, ms since 1970
  // --- the window, as it was judged: decimated, missing cycles stood in for ---
  std::vector<double> sp;
  std::vector<double> pv;
  std::vector<double> co;
  std::vector<double> stem;
  double sample_time_s = 0.1;
  double pv_low = 0.0;
  double pv_high = 100.0;
  double co_low = 0.0;
  double co_high = 100.0;
  // --- what was found ---
  loopwarden::monitor::WindowMeasures measures;
  loopwarden::monitor::WindowJudgement judgement;
  // --- by whom ---
  std::string version;             // of the program
  std::uint32_t config_hash = 0;   // CRC-32 of the configuration files, as in the status
  std::string loop_file;           // as it was read
  std::string specialists_folder;  // as it was read
  std::uint32_t specialists_hash =
      0;  // CRC-32 of its manifest, which has the digests of all weights

  void take(const loopwarden::monitor::Window& window) {
    sp.assign(window.sp.begin(), window.sp.end());
    pv.assign(window.pv.begin(), window.pv.end());
    co.assign(window.co.begin(), window.co.end());
    stem.assign(window.stem.begin(), window.stem.end());
    sample_time_s = window.sample_time_s;
    pv_low = window.pv_low;
    pv_high = window.pv_high;
    co_low = window.co_low;
    co_high = window.co_high;
  }
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
