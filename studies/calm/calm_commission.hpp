// SPDX-License-Identifier: Apache-2.0
// What the project itself finds out about a random sticky loop: the way of corrective action, in numbers.
//
//   twin      `commission` from twenty minutes with a healthy valve and six moves of the set point, and from a belief
//             that is off by up to 30 %
//   alarm     the twin's watch (model_gap) on minutes in which the valve begins to stick
//   s, j      the explanation of that alarm, where it is stiction
#pragma once

#include <optional>

#include "model/control/planned_moves_settings.hpp"
#include "model/numeric/random.hpp"
#include "studies/calm/calm_study.hpp"

namespace loopwarden::studies {

// Nothing: no twin, no alarm, or another explanation: planned moves are not offered.
std::optional<control::PlannedMovesSettings> found_out(const StickyLoop& loop,
                                                       numeric::Random& random);

}  // namespace loopwarden::studies
