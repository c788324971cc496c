// SPDX-License-Identifier: Apache-2.0
// Does PV stand while CO moves?
//
//   du, dy     changes of CO and of PV over a fourteenth of a period
//   moving     samples with |du| above half the deviation of du;  standing: |dy| below half the deviation of dy
//   standing   share of the moving samples at which PV stands, 0 to 1
//
// Behind a sticking valve PV rests on levels and jumps between them, while the controller ramps CO through the band: 0.5 to 0.9.
// Where PV follows CO, both move at once: below 0.3. A sine a quarter of a period apart gives 0.4, noise 0.5: this witness
// counts beside others only.
//
// Source: words of PV and CO after Y. Yamashita, Control Engineering Practice 14 (2006).
//
// Limits: it can't a slow lag rounds the levels, on levels and temperatures PV never stands.
#pragma once

#include <span>

namespace loopwarden::diagnosis {

// Series of one length without slow movement; `period` in samples.
double standing_evidence(std::span<const double> pv, std::span<const double> co, double period);

}  // namespace loopwarden::diagnosis
