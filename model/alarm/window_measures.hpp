// SPDX-License-Identifier: Apache-2.0
// The classical measures of a window: values of a loop and its valve that need no training.
//
//   oscillation_index  regularity r of PV's autocorrelation (oscillation.hpp); above 1 it
//                      oscillates
//   period_s           s, of that oscillation; 0 without oscillation
//   variability        standard deviation of SP - PV, % of the PV span
//   mean_error         mean of SP - PV, % of the PV span
//   saturated          share of the samples with CO at an end of its range, %
//   travel             path of the stem, % of the CO span per hour; path of CO without a read-back
//   reversals          changes of its direction, per hour; moves below the resolution don't count
//   stick              travel of CO after a reversal before the valve follows, % of the CO span
//
// stick with a read-back: the median, over the reversals of the stem, of CO's travel from its
// turning point to the move that answers it. That is S of the stiction model, and the dead band of
// a backlash. Without one: the width of the ellipse from the covariance of PV and CO, in the
// direction of CO, 2 sqrt(2) sigma_CO sqrt(1 - rho^2), the apparent stiction. It includes the lag
// of the process and is therefore an upper bound. It is given only if the loop oscillates.
//
// No errors. Fewer than two samples give zeros.
// Limits: it can't distinguish stiction from backlash, or either from a slow positioner. It can't
// see a stick that the loop does not cross within the window.
//
// Source: M. A. A. S. Choudhury, S. L. Shah, N. F. Thornhill and D. S. Shook, Control Engineering
// Practice 14 (2006), for the apparent stiction; ANSI/ISA-75.25.01 for how a dead band is measured
// on a stem.
#pragma once

#include <cstddef>
#include <cstdint>

#include "model/alarm/window.hpp"

namespace loopwarden::alarm {

enum class StickSource : std::uint8_t { none, read_back, ellipse };

struct WindowMeasures {
  double oscillation_index = 0.0;
  double period_s = 0.0;
  double variability_percent = 0.0;
  double mean_error_percent = 0.0;
  double saturated_percent = 0.0;
  double travel_percent_per_hour = 0.0;
  double reversals_per_hour = 0.0;
  double stick_percent = 0.0;
  StickSource stick_source = StickSource::none;
  double set_point_range_percent = 0.0;  // highest less lowest SP of the window, % of the PV span
  std::size_t bridged_cycles = 0;        // interpolated cycles of the window
};

// Returns the measures of `window`.
WindowMeasures measure(const Window& window);

}  // namespace loopwarden::alarm
