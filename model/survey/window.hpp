// SPDX-License-Identifier: Apache-2.0
// One window of one loop, such as a shift of eight hours, judged without a model and without tuning.
//
//   automatic   share of the samples in automatic; NaN where the export has no mode
//   complete    share of the samples with PV and CO
//   saturated   share of the samples in which CO is at its highest or lowest value of the range
//   error       RMS of PV - SP, PV units; NaN without SP
//   crossings   of PV through SP, 1/h
//   variability share of the variance that could be foretold one dead time ahead (variability.hpp)
//   travel      sum of |CO(k) - CO(k-1)| beyond the noise of CO, CO units/h; reversals: changes of its direction, 1/h
//   noise       PV units: from second differences, sqrt(median (d2 y)^2 / (6 * 0.455))
//   the rest    diagnosis (diagnosis/diagnosis.hpp) of what is in automatic, minded by what an archive left out
//
// What it can't do: see diagnosis; dead time is an estimate from CO and PV together, at least one sample.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "model/diagnosis/archive_rule.hpp"
#include "model/diagnosis/diagnosis.hpp"

namespace loopwarden::survey {

// Columns of one length; `sp` and `automatic` (1 yes, 0 no, NaN not known) may be empty.
struct LoopSamples {
  std::span<const double> pv, co, sp, automatic;
  double sample_time_s = 1.0;
  double co_low = 0.0;  // CO units
  double co_high = 100.0;
  diagnosis::LoopKind kind = diagnosis::LoopKind::unknown;
  diagnosis::Archived archived{};
};

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
  double regularity = 0.0;
  double nonlinearity = 0.0;  // 0 where the loop does not oscillate
  double sees_from = 0.0;     // CO units
  diagnosis::Diagnosis diagnosis;
};

WindowFindings judge_window(const LoopSamples& samples, std::uint64_t seed);

// The windows of a loop judged anew with how CO turns in all of them (diagnosis::share_turns), then minded by what the archive
// left out.
void share_turns(std::span<WindowFindings> windows, const diagnosis::Archived& archived,
                 double co_span);

// All windows of a loop together.
diagnosis::LoopVerdict judge_windows(std::span<const WindowFindings> windows,
                                     const diagnosis::Archived& archived, double co_span);

// Of a loop that another cause than its valve swings: the first of the windows up to the last that all have this cause.
// Nothing where the last one has another, or the verdict is another.
std::optional<std::size_t> cause_since(std::span<const WindowFindings> windows,
                                       const diagnosis::LoopVerdict& verdict);

}  // namespace loopwarden::survey
