// SPDX-License-Identifier: Apache-2.0
// Odd-phase evidence (`phase` in reports): measures whether the cross-correlation of CO and PV is
// odd (a valve) or even (no
// valve).
//
//   c(k) = sum PV(i + k) CO(i),  |k| <= P/2
//   odd  = S (c(k) - c(-k))^2 / [S (c(k) - c(-k))^2 + S (c(k) + c(-k))^2]
//   ph   = mean over three scales (time_scales.hpp) of log(odd / (1 - odd)); odd 0.01 to 0.99
//
// ph from -4.6 (CO and PV in step or in opposition) to +4.6 (a quarter period apart); above 0
// indicates the valve. PV itself, not PV - SP: a set point that moves makes CO move, and a healthy
// valve makes PV follow.
//
// Source: A. Horch, "A simple method for detection of stiction in control valves", Control
// Engineering Practice 7 (1999); share of energy and scales in place of its two lags.
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
