// SPDX-License-Identifier: Apache-2.0
// Sentences with numbers in them.
#pragma once

#include <string>

namespace loopwarden::numeric {

// As printf, up to 511 characters.
[[gnu::format(printf, 1, 2)]] std::string text(const char* format, ...);

}  // namespace loopwarden::numeric
