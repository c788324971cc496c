// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "model/numeric/root_sum_square.hpp"

namespace loopwarden::control {

using numeric::root_sum_square;

}  // namespace loopwarden::control
