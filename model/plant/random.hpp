// SPDX-License-Identifier: Apache-2.0
// The plant's noise and random loads draw from the numeric kit's generator.
#pragma once

#include "model/numeric/random.hpp"

namespace loopwarden::plant {

using numeric::Random;

}  // namespace loopwarden::plant
