// SPDX-License-Identifier: Apache-2.0
// Identifies a random sticky loop with the project's own functions, in the sequence of the
// corrective action:
//
//   twin   `commission` from twenty minutes with a healthy valve and six set-point moves, and from
//          initial values that are wrong by up to 30 %
//   alarm  the twin's alarm (model_gap) on minutes in which the valve begins to stick
//   s, j   the explanation of that alarm, if it is stiction
#pragma once

#include <optional>

#include "model/control/planned_moves_settings.hpp"
#include "model/numeric/random.hpp"
#include "lab/calm_study/calm_study.hpp"

namespace loopwarden::lab {

// Returns nullopt if there is no twin, no alarm, or another explanation. Planned moves are then not
// offered.
std::optional<control::PlannedMovesSettings> found_out(const StickyLoop& loop,
                                                       numeric::Random& random);

}  // namespace loopwarden::lab
