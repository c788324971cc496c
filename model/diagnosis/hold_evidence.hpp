// SPDX-License-Identifier: Apache-2.0
// Hold evidence (`standing` in reports): measures how often PV rests while CO moves.
//
//   du, dy     changes of CO and of PV over a fourteenth of a period
//   moving     samples with |du| above half the deviation of du
//   at rest    samples with |dy| below half the deviation of dy
//   standing   share of the moving samples at which PV rests, 0 to 1
//
// With a sticking valve PV rests on levels and jumps between them, while the controller ramps CO
// through the band: 0.5 to 0.9. If PV follows CO, both move at once: below 0.3. A sine a quarter
// of a period apart gives 0.4, noise 0.5, so this indicator counts only together with others.
//
// Source: words of PV and CO after Y. Yamashita, Control Engineering Practice 14 (2006).
//
// Limits: a slow lag rounds the levels. On levels and temperatures PV never rests.
#pragma once

#include <span>

namespace loopwarden::diagnosis {

// Returns the hold evidence of series of one length without slow movement; `period` in samples.
double hold_evidence(std::span<const double> pv, std::span<const double> co, double period);

}  // namespace loopwarden::diagnosis
