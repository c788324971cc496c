// SPDX-License-Identifier: Apache-2.0
// Small functions of one number.
#pragma once

namespace loopwarden::control {

// Returns -1 below 0, otherwise 1.
constexpr double sign_of(double x) noexcept { return x < 0.0 ? -1.0 : 1.0; }
constexpr double squared(double x) noexcept { return x * x; }

}  // namespace loopwarden::control
