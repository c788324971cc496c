// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace loopwarden::hal::iio {

// Wait between two attempts to open a channel or a line.
inline constexpr std::int64_t kRetryNs = 1'000'000'000;

}  // namespace loopwarden::hal::iio
