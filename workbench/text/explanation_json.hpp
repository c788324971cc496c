// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "model/twin/explain.hpp"

namespace loopwarden::workbench {

// Of a transition under `alarm`, as `replay --twin` prints it. `first_s`: the record's time at its first sample.
nlohmann::json explanation_json(const twin::Explanation& explanation,
                                alarm::AlarmKind alarm, double first_s, double period_s);

// The effect that the explanation names first, for plant words and registers; null: none.
nlohmann::json first_effect_json(const twin::Explanation& explanation);

}  // namespace loopwarden::workbench
