// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "model/twin/explain.hpp"

namespace loopwarden::workbench {

// Returns the explanation of a transition under `alarm`, as `replay --twin` prints it. `first_s`:
// time of the record's first sample.
nlohmann::json explanation_json(const twin::Explanation& explanation, alarm::AlarmKind alarm,
                                double first_s, double period_s);

// Returns the first effect of the explanation, for plant words and registers; null: no effect.
nlohmann::json first_effect_json(const twin::Explanation& explanation);

}  // namespace loopwarden::workbench
