// SPDX-License-Identifier: Apache-2.0
// A law without a name: what linear columns, added to a hypothesis, explain beyond it.
//
//   PV = PV of the hypothesis + sum of w_j f_j,   w_j ~ N(0, d_j^2)
//
//   family            columns f_j                                                   d_j
//   static            response of PV to hats of the flow, over the range of CO      0.04 CO spans
//   hysteretic        response to plays of the flow, less the flow                  0.5
//   dynamic           z through further lags and delays, less z                     0.4
//   by state          rate of z: rising only, times level, times time               0.3 to 0.5 A
//   gain by time      z times cosines of time                                       0.15 / sqrt i
//   meter play        plays of z, less z                                            0.5
//   meter curve       hats of z                                                     0.04 PV spans
//
//   z  response of PV to the flow at the gain of the model     A  answer time, s
//
// A family of the same kind as a named effect is left out: a curve that isn't exactly the stated
// one is still a curve.
// The weights are integrated out like every linear parameter. If such a law predicts the last third
// of the record better than the named one, the name is not the whole truth.
#pragma once

#include <string>
#include <vector>

#include "model/estimator/competition.hpp"

namespace loopwarden::estimator {

struct Flexible {
  std::string family;      // "static", "dynamic + by state"; empty: none is better
  double lead = 0.0;       // nats above the hypothesis
  std::vector<double> pv;  // free run of the whole record, PV units
  // The disturbance that is left with it, PV units per root second: what it explains is none.
  double disturbance = 0.0;
  std::vector<double> parts;  // lead by part of the record, nats
};

// The best family or combination, added to `fit`.
Flexible flexible_law(const Likelihood& likelihood, const Fit& fit, std::size_t samples);

}  // namespace loopwarden::estimator
