// SPDX-License-Identifier: Apache-2.0
// Odd-phase evidence (`phase` in reports): measures whether the cross-correlation of CO and PV is
// odd (a valve) or even (no valve). Equations and source: docs/math/valve-evidence.md.
//
// Limits: on integrating processes, and with integral control of a slow load at a constant set
// point, the phase is a quarter period without any stiction.
#pragma once

#include "model/diagnosis/time_scales.hpp"

namespace loopwarden::diagnosis {

// Returns the odd share, 0 to 1, of two series of one length about their means, `period` in
// samples; 0 without movement.
double odd_share(std::span<const double> pv, std::span<const double> co, double period);
double odd_phase_evidence(const TimeScales& pv, const TimeScales& co, double period);

}  // namespace loopwarden::diagnosis
