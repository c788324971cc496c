// SPDX-License-Identifier: Apache-2.0
// The figures of one window of one loop, such as a shift of eight hours, without a model and
// without tuning. The faults of the loop are judged separately (diagnosis/diagnosis.hpp).
//
//   automatic   share of the samples in automatic; NaN if the export has no mode
//   complete    share of the samples with PV and CO
//   saturated   share of the samples in which CO is at its highest or lowest value of the range
//   error       RMS of PV - SP, PV units; NaN without SP
//   crossings   of PV through SP, 1/h
//   variability share of the variance that is predictable one dead time ahead (variability.hpp)
//   travel      sum of |CO(k) - CO(k-1)| beyond the noise of CO, CO units/h; reversals: changes of
//               its direction, 1/h
//   noise       PV units: from second differences, sqrt(median (d2 y)^2 / (6 * 0.455))
//
// Limits: the dead time is an estimate from CO and PV together, at least one sample.
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "model/diagnosis/classifier.hpp"
#include "model/numeric/loop_record.hpp"

namespace loopwarden::diagnosis {

struct WindowFindings {
  double automatic = 1.0;
  double complete = 1.0;
  double saturated = 0.0;
  double error = 0.0;
  double crossings_per_hour = 0.0;
  double variability = 0.0;
  double dead_time_s = 0.0;
  double travel_per_hour = 0.0;
  double reversals_per_hour = 0.0;
  double noise = 0.0;
};

WindowFindings judge_window(const numeric::LoopView& samples);

// Returns the index of the first window from which all causes up to the newest are `cause`; empty
// if the newest one is another. `causes` are in the order of time.
std::optional<std::size_t> cause_since(std::span<const diagnosis::Cause> causes,
                                       diagnosis::Cause cause);

}  // namespace loopwarden::diagnosis
