// SPDX-License-Identifier: Apache-2.0
// Play evidence: measures whether PV follows CO better through a play than linearly.
//
//   r2_lin   best R^2 of PV on CO, dead time 0 to P/4, lag 0 or 0.04 P
//   r2_play  best R^2 of PV on play(CO, b R), the same dead times and lags, b 0.15 to 0.9, R the
//            range of CO from 2 to 98 %
//   pl       mean over three scales (time_scales.hpp) of
//            log[(1 - r2_lin + 0.01) / (1 - r2_play + 0.01)], within -1.5 to 1.5
//
// Above 0 indicates the valve. The short lag is that of the transmitter and the process. Without
// it a band would replace the lag, because both round the corners. A longer lag rounds the corners
// of a play away.
//
// Source: fit of PV over CO with and without the valve's loop, after M. A. A. S. Choudhury, S. L.
// Shah, N. F. Thornhill and D. S. Shook, Control Engineering Practice 14 (2006), who fit an
// ellipse; play operator as in model/effects/backlash/backlash.hpp.
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
