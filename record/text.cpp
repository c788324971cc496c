// SPDX-License-Identifier: Apache-2.0
#include "record/text.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cstddef>
#include <limits>

namespace loopwarden::record {

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

double parse_mode(std::string_view text) {
  constexpr std::array kBySystem{"1",       "auto", "automatic", "aut",    "a",    "cas",
                                 "cascade", "rcas", "rsp",       "remote", "true", "on"};
  constexpr std::array kByHand{"0",  "2",        "man",   "manual", "m",   "rout",  "iman",
                               "lo", "fallback", "false", "off",    "oos", "track", "trk"};
  const std::string word = lower_case(text);
  const auto is = [&](const char* known) { return word == known; };
  if (std::any_of(kBySystem.begin(), kBySystem.end(), is)) return 1.0;
  if (std::any_of(kByHand.begin(), kByHand.end(), is)) return 0.0;
  // As programs write whole numbers of a column that has gaps: 1.0.
  double number = 0.0;
  const auto [end, problem] = std::from_chars(word.data(), word.data() + word.size(), number);
  if (problem == std::errc() && end == word.data() + word.size()) {
    if (number == 1.0) return 1.0;
    if (number == 0.0 || number == 2.0) return 0.0;
  }
  // B-AUTO, Man (forced)
  if (word.find("auto") != std::string::npos || word.starts_with("cas")) return 1.0;
  if (word.find("man") != std::string::npos) return 0.0;
  return std::numeric_limits<double>::quiet_NaN();
}

}  // namespace loopwarden::record
