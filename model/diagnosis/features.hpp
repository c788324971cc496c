// SPDX-License-Identifier: Apache-2.0
// All measures of a record for the judgement of its valve, as one list of numbers without unit.
// Each is bounded and independent of sample time and span.
#pragma once

#include <array>
#include <cstddef>

#include "model/diagnosis/decision.hpp"
#include "model/diagnosis/preparation.hpp"

namespace loopwarden::diagnosis {

// In the order of the classifier's table, which find_features() keeps.
inline constexpr std::size_t kFeatures = 42;
using Features = std::array<double, kFeatures>;

// Returns the features. `prepared` must not have a refusal.
Features find_features(const Prepared& prepared, const ValveEvidence& evidence);

}  // namespace loopwarden::diagnosis
