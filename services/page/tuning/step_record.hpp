// SPDX-License-Identifier: Apache-2.0
// The recorded stretch around the newest step of the set point in automatic, for the identification
// of a process.
//
// It begins 5 integral times of the controller in force before the step and ends 20 after it, so
// that the loop has settled on both sides. It has at least 300 samples and at most four days or two
// million rows. A move of the set point counts from 1 % of PV's range; the step of a ramp is its
// end. Long stretches are thinned by averaging to at most kMostSamples, which limits the time of
// the identification.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "model/numeric/loop_record.hpp"
#include "services/page/history/history.hpp"

namespace loopwarden::page::tuning {

inline constexpr std::size_t kMostSamples = 1500;

struct StepRecord : numeric::LoopRecord {  // NaN where missing
  std::int64_t step_ms = 0;                // UTC
  std::int64_t from_ms = 0, to_ms = 0;     // UTC, of the columns
};

struct StepWish {
  double sample_time_s = 0.1;    // of the loop
  double ms_per_s = 1000.0;      // less if the loop runs faster than real time
  double integral_time_s = 0.0;  // of the controller in force; 0: no integral action
  double pv_span = 100.0;        // PV units
  std::int64_t now_ms = 0;       // UTC
};

// Returns nullopt if the record has no move of the set point. Throws record::RecordError if the
// folder can't be read.
std::optional<StepRecord> newest_step(history::History& history,
                                      const std::filesystem::path& folder, const StepWish& wish);

}  // namespace loopwarden::page::tuning
