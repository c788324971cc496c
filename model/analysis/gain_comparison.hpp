// SPDX-License-Identifier: Apache-2.0
// Compares gains on the disturbance and the set points of one record.
//
//   d(k) = PV(k) - PV of the model for the recorded CO
//   the closed loop of the model, with d added to its PV, is simulated with each of the gains
//
// Limits: valve effects are left out, and so are limits of CO that the model does not have. An error
// of the model is part of d, so gains far from those of the record are compared less exactly.
#pragma once

#include <array>
#include <optional>

#include "model/control/tuning.hpp"
#include "model/numeric/loop_record.hpp"
#include "model/plant/loop_model.hpp"

namespace loopwarden::analysis {

// Returns the RMS of SP - PV with each of the gains, PV units. `record`: complete, in automatic.
// nullopt if it has no SP or fewer than 100 samples, or if a simulation does not stay finite.
std::optional<std::array<double, 2>> compare_gains(const numeric::LoopView& record,
                                                   const plant::LoopModel& model,
                                                   const std::array<control::PidGains, 2>& gains);

}  // namespace loopwarden::analysis
