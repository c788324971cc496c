// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace loopwarden::config {

// SHA-256 in 64 lower-case hexadecimal digits.
std::string sha256_of(std::string_view bytes);

}  // namespace loopwarden::config
