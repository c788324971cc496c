// SPDX-License-Identifier: Apache-2.0
// Small things on text that many need.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace loopwarden::base {

// Without the spaces and tabs at both ends.
std::string_view trimmed(std::string_view text) noexcept;
std::string lower_case(std::string_view text);  // of ASCII, whatever the locale
// A name for people: a space for each '_'.
std::string in_words(std::string_view name);
// As one word of a command that people copy into a shell.
std::string as_shell_word(std::string_view text);
// For messages: short, and without what a terminal would act on.
std::string in_quotes(std::string_view text);

// RFC 3986: letters, digits and -._~ stay, every other byte becomes %XX. For a part of a path or query.
std::string percent_encoded(std::string_view text);

// Where the first byte is that is not UTF-8 (RFC 3629: no overlong form, no surrogate, nothing above U+10FFFF); npos if
// all is.
std::size_t first_not_utf8(std::string_view text);
inline bool is_utf8(std::string_view text) { return first_not_utf8(text) == text.npos; }
// The same of text that may end within a character.
bool is_start_of_utf8(std::string_view text);
// The first bytes, at most `most_bytes`, without a character that would be cut.
std::string_view cut(std::string_view text, std::size_t most_bytes) noexcept;

}  // namespace loopwarden::base
