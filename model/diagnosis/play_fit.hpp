// SPDX-License-Identifier: Apache-2.0
// Play evidence: measures whether PV follows CO better through a play than linearly. Equations and
// source: docs/math/valve-evidence.md.
//
// Limits: a longer lag also makes a loop of PV over CO, so this indicator is weak without the
// others.
#pragma once

#include "model/diagnosis/time_scales.hpp"

namespace loopwarden::diagnosis {

struct PlayFit {
  double evidence = 0.0;   // pl
  double linear_r2 = 0.0;  // means over the scales, 0 to 1
  double play_r2 = 0.0;
  double band = 0.0;  // CO units, median over the scales
};

PlayFit fit_play(const TimeScales& pv, const TimeScales& co, double period);

}  // namespace loopwarden::diagnosis
