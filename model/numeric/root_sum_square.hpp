// SPDX-License-Identifier: Apache-2.0
// Returns sqrt(a^2 + b^2) for values whose squares don't overflow.
//
// Used instead of std::hypot, which the C library of Debian 12 rounds differently on arm64 and
// x86-64.
#pragma once

#include <cmath>

namespace loopwarden::numeric {

inline double root_sum_square(double a, double b) noexcept { return std::sqrt(a * a + b * b); }

}  // namespace loopwarden::numeric
