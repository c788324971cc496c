// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace loopwarden::config {

// ASCII digits only, in any locale.
constexpr bool is_digit(char c) { return c >= '0' && c <= '9'; }

}  // namespace loopwarden::config
