// SPDX-License-Identifier: Apache-2.0
// Written by `loopwarden-study diagnose --records data/routine data/isdb data/measured --weights FILE --cases 2000 --seed 5`;
// not edited by hand.
#pragma once

#include "model/diagnosis/decision.hpp"

namespace loopwarden::diagnosis {

inline constexpr ValveWeights kAtOnce{.base = -1.18, .per = {0.19, 1.41, 1.14, 2.00}};
inline constexpr ValveWeights kLater{.base = -1.01, .per = {0.11, 0.00, 0.00, 5.39}};

}  // namespace loopwarden::diagnosis
