// SPDX-License-Identifier: Apache-2.0
// Written by `loopwarden-study diagnose --records data/routine data/isdb data/measured --weights FILE --cases 2000 --seed 5`;
// not edited by hand.
#pragma once

#include "model/diagnosis/decision.hpp"

namespace loopwarden::diagnosis {

inline constexpr ValveWeights kAtOnce{.base = -1.22, .per = {0.18, 1.26, 1.32, 2.00}};
inline constexpr ValveWeights kLater{.base = -0.90, .per = {0.09, 0.00, 0.00, 4.94}};

}  // namespace loopwarden::diagnosis
