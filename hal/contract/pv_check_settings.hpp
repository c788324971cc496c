// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

namespace loopwarden::hal {

// Limits of the checks on a loop's signals, made before the signals are used.
struct PvCheckSettings {
  double low = 0.0;             // PV units, the transmitter's range
  double high = 100.0;          // PV units
  double range_margin = 0.05;   // share of the span that a signal may be outside before it is bad
  double max_age_s = 0.3;       // s; older is bad
  double frozen_after_s = 0.0;  // s within which PV must change after the output moved; 0: not
                                // checked
  // True: the controller of this loop treats a frozen PV as bad. False: only the alarm is raised.
  bool frozen_acts = false;
  // s for which a value of a live source may be held without a new sample; older is bad; 0: no
  // limit
  double max_held_s = 0.0;

  friend bool operator==(const PvCheckSettings&, const PvCheckSettings&) = default;
};

// Returns the usual frozen_after, s. `answer_s`: time in which a slow loop responds to its output;
// 0: unknown.
constexpr double usual_frozen_after_s(double sample_time_s, double answer_s = 0.0) noexcept {
  return std::max({60.0, 30.0 * sample_time_s, answer_s});
}

}  // namespace loopwarden::hal
