// SPDX-License-Identifier: Apache-2.0
// Written by `loopwarden-study diagnose --weights`; not edited by hand.
#pragma once

#include "model/diagnosis/decision.hpp"

namespace loopwarden::diagnosis {

inline constexpr ValveWeights kAtOnce{.base = -1.92, .per = {0.26, 0.56, 8.2}};
inline constexpr ValveWeights kLater{.base = -1.5, .per = {0.05, 0.2, 6.0}};

}  // namespace loopwarden::diagnosis
