// SPDX-License-Identifier: Apache-2.0
#include "base/text.hpp"

#include <cctype>
#include <cstddef>

namespace loopwarden::base {

std::string_view trimmed(std::string_view text) noexcept {
  while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
  while (!text.empty() && (text.back() == ' ' || text.back() == '\t')) text.remove_suffix(1);
  return text;
}

std::string lower_case(std::string_view text) {
  std::string lower(text);
  for (char& c : lower) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return lower;
}

std::string in_quotes(std::string_view text) {
  constexpr std::size_t kMostCharacters = 40;
  std::string shown;
  for (const char c : text.substr(0, kMostCharacters)) {
    const auto byte = static_cast<unsigned char>(c);
    shown += byte < 0x20 || byte == 0x7F ? '?' : c;
  }
  return "'" + shown + (text.size() > kMostCharacters ? "...'" : "'");
}

}  // namespace loopwarden::base
