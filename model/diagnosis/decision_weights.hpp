// SPDX-License-Identifier: Apache-2.0
// Written by `loopwarden-study diagnose --records examples/routine examples/isdb examples/measured
// --weights FILE --cases 2000 --seed 5`; not edited by hand.
#pragma once

#include "model/diagnosis/decision.hpp"

namespace loopwarden::diagnosis {

inline constexpr ValveWeights kAtOnce{.base = -1.12, .per = {0.17, 1.98, 1.05, 2.00}};
inline constexpr ValveWeights kLater{.base = -1.05, .per = {0.08, 0.39, 0.00, 5.51}};

}  // namespace loopwarden::diagnosis
