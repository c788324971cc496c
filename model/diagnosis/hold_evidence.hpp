// SPDX-License-Identifier: Apache-2.0
// Hold evidence (`standing` in reports): measures how often PV rests while CO moves. Equations and
// source: docs/math/valve-evidence.md.
//
// Limits: a slow lag rounds the levels. On levels and temperatures PV never rests.
#pragma once

#include <span>

namespace loopwarden::diagnosis {

// Returns the hold evidence of series of one length without slow movement; `period` in samples.
double hold_evidence(std::span<const double> pv, std::span<const double> co, double period);

}  // namespace loopwarden::diagnosis
