// SPDX-License-Identifier: Apache-2.0
// People and files supply names and reasons. Before these go into a header, a log line or a field,
// they become one line of valid UTF-8.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace loopwarden::notify {

// Returns `text` with '?' in place of control characters, line and paragraph separators, marks that
// turn the direction of writing, and invalid UTF-8. At most `most_bytes`, cut between characters.
std::string one_line(std::string_view text, std::size_t most_bytes = 300);

}  // namespace loopwarden::notify
