// SPDX-License-Identifier: Apache-2.0
// sqrt(a^2 + b^2), of values whose squares are far from the largest number.
//
// Not std::hypot, which Debian 12's C library rounds otherwise on arm64 than on x86-64.
#pragma once

#include <cmath>

namespace loopwarden::numeric {

inline double root_sum_square(double a, double b) noexcept { return std::sqrt(a * a + b * b); }

}  // namespace loopwarden::numeric
