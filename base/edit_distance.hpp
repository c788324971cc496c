// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string_view>

namespace loopwarden::base {

// Returns the number of insertions, deletions, replacements and swaps of neighbours that turn `a`
// into `b`.
std::size_t edit_distance(std::string_view a, std::string_view b);

}  // namespace loopwarden::base
