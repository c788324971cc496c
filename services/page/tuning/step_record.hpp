// SPDX-License-Identifier: Apache-2.0
// The recorded stretch around the newest step of the set point in automatic: what a process is identified from.
//
// From 5 integral times of the controller in force before the step to 20 after it, so that the loop has settled on both sides;
// at least 300 samples, at most what four days or two million rows hold. The move of a set point is what of it is 1 % of PV's
// range or more; of a ramp its end counts as the step. Long stretches are thinned by means of so many samples each that at most
// kMostSamples are left: that bounds the time of the identification.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "services/page/history/history.hpp"

namespace loopwarden::page::tuning {

inline constexpr std::size_t kMostSamples = 1500;

struct StepRecord {
  std::int64_t step_ms = 0;              // UTC
  std::int64_t from_ms = 0, to_ms = 0;   // UTC, of what is below
  double sample_time_s = 0.1;            // of what is below
  std::vector<double> sp, pv, co, mode;  // NaN where missing; mode 1: automatic
};

struct StepWish {
  double sample_time_s = 0.1;    // of the loop
  double ms_per_s = 1000.0;      // less where the loop runs faster than time
  double integral_time_s = 0.0;  // of the controller in force; 0: none
  double pv_span = 100.0;        // PV units
  std::int64_t now_ms = 0;       // UTC
};

// Nothing: no set point has moved in what is recorded. Throws record::RecordError where the folder can't be read.
std::optional<StepRecord> newest_step(history::History& history,
                                      const std::filesystem::path& folder, const StepWish& wish);

}  // namespace loopwarden::page::tuning
