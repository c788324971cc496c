// SPDX-License-Identifier: Apache-2.0
// Measures of a step response.
//
//   r(t) = (y(t) - y0) / (y1 - y0)        y0 before the step, y1 final or desired value, PV units
//
//   delay_s           first time at which r reaches 1/2
//   rise_10_90_s      from r = 0.1 to r = 0.9
//   peak_time_s       time of the largest r if it exceeds 1, otherwise 0
//   overshoot         max r - 1, not below 0
//   settling_2_s      last time at which |r - 1| > 0.02, plus one period; likewise 5 %
//
// Times count from the first sample and are interpolated between samples. A time is infinite if r
// never reaches the level, and a settling time if the record ends outside the band.
// Errors: no exceptions; samples that are not finite are skipped. All times are infinite for fewer
// than two samples or y1 = y0.
// Limits: noise above a few percent of the step makes the first crossing too early and the settling
// time too late; filter the record first.
//
// Source: Ogata, Modern Control Engineering (2010), section 5.3; Sewdass, thesis, section 6.3.1.
#pragma once

#include <limits>
#include <span>

namespace loopwarden::analysis {

struct StepMetrics {
  static constexpr double kNever = std::numeric_limits<double>::infinity();
  double delay_s = kNever;
  double rise_10_90_s = kNever;
  double peak_time_s = 0.0;
  double overshoot = 0.0;  // share of the step, 0.1: 10 %
  double settling_2_s = kNever;
  double settling_5_s = kNever;
};

// Returns the measures. `y` begins at the step. Times include the dead time.
StepMetrics step_metrics(std::span<const double> y, double before, double final_value,
                         double sample_time_s);

}  // namespace loopwarden::analysis
