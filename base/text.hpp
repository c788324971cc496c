// SPDX-License-Identifier: Apache-2.0
// Small functions on text.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace loopwarden::base {

// Returns `text` without leading and trailing spaces and tabs.
std::string_view trimmed(std::string_view text) noexcept;
std::string lower_case(std::string_view text);  // ASCII letters only, in any locale
// Returns a name for people: each '_' becomes a space.
std::string in_words(std::string_view name);
// Returns whether the area `path` is `area` or a part of it: Unit 2/Reactor is in Unit 2.
bool is_in_area(std::string_view path, std::string_view area) noexcept;
// Returns the text quoted as one word of a shell command.
std::string as_shell_word(std::string_view text);
// Returns the text for a message: shortened, and without characters that a terminal interprets.
std::string in_quotes(std::string_view text);

// Encodes as RFC 3986: letters, digits and -._~ stay, every other byte becomes %XX. For a part of a
// path or query.
std::string percent_encoded(std::string_view text);

// Returns the position of the first byte that is not UTF-8 (RFC 3629: no overlong form, no
// surrogate, no code point above U+10FFFF); npos if all are valid.
std::size_t first_not_utf8(std::string_view text);
inline bool is_utf8(std::string_view text) { return first_not_utf8(text) == text.npos; }
// Returns whether the text is UTF-8 that may end within a character.
bool is_start_of_utf8(std::string_view text);
// Returns the first bytes, at most `most_bytes`. A character that would be cut is left out.
std::string_view cut(std::string_view text, std::size_t most_bytes) noexcept;

}  // namespace loopwarden::base
