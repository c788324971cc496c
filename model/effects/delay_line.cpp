// SPDX-License-Identifier: Apache-2.0
#include "model/effects/delay_line.hpp"

#include <bit>

namespace loopwarden::effects {

DelayLine::DelayLine(std::size_t samples)
    : values_(std::bit_ceil(samples + 1), 0.0), mask_(values_.size() - 1) {}

}  // namespace loopwarden::effects
