// SPDX-License-Identifier: Apache-2.0
// Where simulation and record disagree: the energy of the difference shared out over blocks, stretches
// of time, and conditions that an engineer can act on. Each sample belongs to one condition, so that
// the shares add up; a pattern in time (a drift, a level from one moment on, a period) that explains
// most of the difference stands before them with what it explains.
#pragma once

#include <vector>

#include "model/gap/controller_block.hpp"
#include "model/gap/result.hpp"

namespace loopwarden::gap {

// From result.series, effects, check and model; fills result.located.
void locate(Result& result, const ControllerFinding& controller,
            const std::vector<double>& energy_by_effect);

}  // namespace loopwarden::gap
