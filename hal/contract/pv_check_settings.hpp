// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace loopwarden::hal {

// Checks on the process variable before the controller believes it.
struct PvCheckSettings {
  double low = 0.0;             // PV units, the transmitter's range
  double high = 100.0;          // PV units
  double range_margin = 0.05;   // share of the span that PV may lie outside before it is bad
  double max_age_s = 0.3;       // s; older is bad
  double frozen_after_s = 0.0;  // s without any change of PV while the output moves; 0: not checked
  // s that a value of a live source may be held without a new sample; older is bad; 0: for ever
  double max_held_s = 0.0;

  friend bool operator==(const PvCheckSettings&, const PvCheckSettings&) = default;
};

}  // namespace loopwarden::hal
