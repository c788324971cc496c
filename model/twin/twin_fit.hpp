// SPDX-License-Identifier: Apache-2.0
// How sure the record is of the twin's process: the covariance of its parameters.
//
//   C = (J'J)^-1 (sum over the blocks of g g') (J'J)^-1,   g = J'r of a block,   J = d PV/d ln parameter
//
// PV is the free run under the measured CO, r = PV measured less it, over the samples that count; J
// by central differences. Blocks are as long as a twentieth of the record: what is left of PV is
// coloured, and within a block it may be so in any way.
//
//   C  of the natural logarithms: its root is a relative standard deviation
//
// Errors: none; of what the record does not touch the variance is kLargest.
// What it can't do: say how wrong the form of the model is.
//
// Source: White, Econometrica 50 (1982) 1-25; Liang and Zeger, Biometrika 73 (1986) 13-22 (sums
// over clusters).
#pragma once

#include "model/gap/record.hpp"
#include "model/plant/loop_model.hpp"

namespace loopwarden::twin {

inline constexpr double kLargest = 0.04;  // relative variance

plant::TwinFit twin_fit(const plant::LoopModel& twin, const numeric::LoopRecord& record);

}  // namespace loopwarden::twin
