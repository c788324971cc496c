// SPDX-License-Identifier: Apache-2.0
// Measures of control quality and valve wear from sampled SP, PV and stem travel.
//
//   rms_error          sqrt(mean (SP - PV)^2), PV units: the figure of merit of a compensator
//   mean_error         mean (SP - PV), PV units
//   amplitude          half the distance between the 5th and the 95th percentile of PV, PV units
//   period             s, mean time between upward crossings of the middle of these percentiles,
//                      with a hysteresis of a third of the amplitude; 0 below two crossings
//   travel             sum |stem(k) - stem(k-1)|, CO units per hour
//   reversals          changes of the stem's direction, per hour
// Moves of the stem below `stem_resolution` don't count as travel.
//
// Errors: no exceptions. The results are 0 for fewer than two samples. Samples that are not finite
// are left out.
// Limits: the period is that of the largest swing; two simultaneous frequencies are not separated.
#pragma once

#include <span>

namespace loopwarden::analysis {

struct LoopMetrics {
  double rms_error = 0.0;           // PV units
  double mean_error = 0.0;          // PV units
  double amplitude = 0.0;           // PV units
  double period_s = 0.0;            // s
  double travel_per_hour = 0.0;     // CO units / h
  double reversals_per_hour = 0.0;  // 1 / h
};

// Returns the measures. All spans have the same length. `stem` may be empty; its measures are then
// 0.
LoopMetrics loop_metrics(std::span<const double> sp, std::span<const double> pv,
                         std::span<const double> stem, double sample_time_s,
                         double stem_resolution);

}  // namespace loopwarden::analysis
