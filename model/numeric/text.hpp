// SPDX-License-Identifier: Apache-2.0
// Formatted text.
#pragma once

#include <string>

namespace loopwarden::numeric {

// Returns the text that printf would print, at most 511 characters.
[[gnu::format(printf, 1, 2)]] std::string text(const char* format, ...);

}  // namespace loopwarden::numeric
