// SPDX-License-Identifier: Apache-2.0
// Written by `loopwarden-study diagnose --records data/routine data/isdb --weights FILE --cases 2000 --seed 5`;
// not edited by hand.
#pragma once

#include "model/diagnosis/decision.hpp"

namespace loopwarden::diagnosis {

inline constexpr ValveWeights kAtOnce{.base = -1.16, .per = {0.13, 3.04, 1.38, 1.71}};
inline constexpr ValveWeights kLater{.base = -1.29, .per = {0.06, 0.00, 0.00, 5.99}};

}  // namespace loopwarden::diagnosis
