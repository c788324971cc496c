// SPDX-License-Identifier: Apache-2.0
#include "record/import/number_text.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdint>

#include "base/text.hpp"

namespace loopwarden::record {
namespace {

// In lower case; what a cell begins with. They stand for PI, PHD, Aspen, OPC clients and spreadsheets.
constexpr std::array<std::string_view, 35> kBadWords{
    "bad",        "no data",     "nodata",      "i/o timeout", "io timeout",    "timeout",
    "nan",        "null",        "n/a",         "none",        "pt created",    "point creat",
    "shutdown",   "comm",        "configure",   "scan off",    "scan time",     "intf shut",
    "no sample",  "no result",   "offline",     "calc",        "error",         "err",
    "over range", "under range", "invalid",     "no lab",      "digital st",    "[-11",
    "inp outr",   "arc off",     "not connect", "out of serv", "not available",
};
constexpr std::array<std::string_view, 4> kDoubtWords{"questionable", "uncertain", "doubtful",
                                                      "substituted"};

bool is_thousands_mark(char c, char decimal) noexcept {
  return c != decimal && (c == ',' || c == '.' || c == '\'' || c == ' ');
}

// "1,234,567.8" without its marks; empty where they don't stand in threes.
std::string without_thousands(std::string_view text, char decimal) {
  std::string plain;
  const std::size_t point = std::min(text.find(decimal), text.size());
  const std::size_t first = text.find_first_of("0123456789");
  if (first == std::string_view::npos) return {};
  char mark = '\0';
  for (std::size_t k = 0; k < text.size(); ++k) {
    const char c = text[k];
    if (k >= point || !is_thousands_mark(c, decimal)) {
      plain += c == decimal ? '.' : c;
      continue;
    }
    if (mark == '\0') mark = c;
    if (c != mark || k == first || (point - k) % 4 != 0) return {};
  }
  if (mark != '\0' && text.find(mark) - first > 3) return {};
  return mark == '\0' ? std::string() : plain;
}

std::optional<double> plain_number(std::string_view text) noexcept {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  double value = 0.0;
  const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (problem != std::errc{} || end != text.data() + text.size() || !std::isfinite(value)) {
    return std::nullopt;
  }
  return value;
}

// Digits with at most one point and no exponent, as nearly all cells are: both whole numbers are exact doubles, so that
// their quotient is the double nearest to the text, as from_chars finds it (W. D. Clinger, PLDI 1990).
bool short_decimal(std::string_view text, char decimal, double& value) noexcept {
  constexpr std::size_t kExactDigits = 15;
  constexpr std::array kPowers{1e0, 1e1, 1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                               1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15};
  const bool negative = text.front() == '-';
  const std::size_t first = negative || text.front() == '+' ? 1 : 0;
  std::uint64_t whole = 0;
  std::size_t digits = 0;
  std::size_t behind = text.size();  // of the point
  for (std::size_t k = first; k < text.size(); ++k) {
    const auto digit = static_cast<unsigned char>(text[k] - '0');
    if (digit <= 9) {
      whole = whole * 10 + digit;
      if (++digits > kExactDigits) return false;
    } else if (text[k] == decimal && behind == text.size()) {
      behind = k + 1;
    } else {
      return false;
    }
  }
  if (digits == 0) return false;
  const double size = static_cast<double>(whole) / kPowers[text.size() - behind];
  value = negative ? -size : size;
  return true;
}

bool begins_with(std::string_view text, std::string_view lower) noexcept {
  if (text.size() < lower.size()) return false;
  for (std::size_t k = 0; k < lower.size(); ++k) {
    if (std::tolower(static_cast<unsigned char>(text[k])) != lower[k]) return false;
  }
  return true;
}

}  // namespace

std::optional<double> parse_number(std::string_view text, char decimal) {
  if (text.empty()) return std::nullopt;
  double quick = 0.0;
  if (short_decimal(text, decimal, quick)) return quick;
  if (decimal == '.') {
    if (const auto value = plain_number(text)) return value;
  } else if (text.size() < 64 && text.find('.') == std::string_view::npos) {
    std::array<char, 64> copy;
    std::replace_copy(text.begin(), text.end(), copy.begin(), decimal, '.');
    if (const auto value = plain_number({copy.data(), text.size()})) return value;
  }
  const bool digit =
      text.front() == '-' || text.front() == '+' || (text.front() >= '0' && text.front() <= '9');
  if (!digit || text.size() > 40) return std::nullopt;
  const std::string plain = without_thousands(text, decimal);
  return plain.empty() ? std::nullopt : plain_number(plain);
}

CellValue parse_value(std::string_view text, char decimal,
                      const std::vector<std::string>& bad_words) {
  if (text.empty()) return {Cell::empty, 0.0};
  if (const auto value = parse_number(text, decimal)) return {Cell::number, *value};
  // A spreadsheet's errors in any language: #VALUE!, #WERT!, #NV, #N/A; and ##### where its column was too narrow.
  if (text.front() == '#' && text.find('.') == std::string_view::npos) return {Cell::bad, 0.0};
  if (text == "-" || text == "--" || text == "?" || text == "*") return {Cell::bad, 0.0};
  const auto begins = [&](std::string_view word) { return begins_with(text, word); };
  if (std::any_of(kBadWords.begin(), kBadWords.end(), begins)) return {Cell::bad, 0.0};
  if (begins_with(text, "inf") || begins_with(text, "-inf")) return {Cell::bad, 0.0};
  if (std::any_of(kDoubtWords.begin(), kDoubtWords.end(), begins)) return {Cell::questionable, 0.0};
  // As historians mark a number that they doubt: 12.3?
  if (text.back() == '?' && parse_number(base::trimmed(text.substr(0, text.size() - 1)), decimal)) {
    return {Cell::questionable, 0.0};
  }
  const auto is = [&](const std::string& word) {
    return text.size() == word.size() && begins_with(text, word);
  };
  if (std::any_of(bad_words.begin(), bad_words.end(), is)) return {Cell::bad, 0.0};
  return {Cell::unknown, 0.0};
}

SampleQuality parse_quality(std::string_view text, bool zero_is_good) {
  if (text.empty()) return SampleQuality::good;
  std::uint64_t code = 0;
  const bool hexadecimal = text.starts_with("0x") || text.starts_with("0X");
  const std::string_view digits = hexadecimal ? text.substr(2) : text;
  const auto [end, problem] =
      std::from_chars(digits.data(), digits.data() + digits.size(), code, hexadecimal ? 16 : 10);
  if (problem == std::errc{} && end == digits.data() + digits.size()) {
    if (code == 0) return zero_is_good ? SampleQuality::good : SampleQuality::bad;
    if (code == 1 || code == 100) return SampleQuality::good;  // a flag, or a confidence in %
    if (code >= 0x40000000U) {                                 // OPC UA
      return code >= 0x80000000U ? SampleQuality::bad : SampleQuality::questionable;
    }
    const std::uint64_t field = code & 0xC0U;
    if (field == 0xC0U) return SampleQuality::good;
    return field == 0x40U ? SampleQuality::questionable : SampleQuality::bad;
  }
  constexpr std::array<std::string_view, 8> kGood{"good",   "ok", "true", "valid",
                                                  "normal", "g",  "a",    "y"};
  const std::string word = base::lower_case(text);
  for (const std::string_view good : kGood) {
    if (word == good || (good.size() > 3 && word.starts_with(good))) return SampleQuality::good;
  }
  const auto begins = [&](std::string_view doubt) { return word.starts_with(doubt); };
  if (std::any_of(kDoubtWords.begin(), kDoubtWords.end(), begins) || word == "u" || word == "q") {
    return SampleQuality::questionable;
  }
  return SampleQuality::bad;
}

bool LineCells::split(std::string_view line, char delimiter, std::size_t* open) {
  cells.clear();
  undone.clear();
  std::size_t at = 0;
  while (true) {
    std::size_t start = at;
    while (start < line.size() && line[start] == ' ') ++start;
    if (start >= line.size() || line[start] != '"') {
      const std::size_t end = std::min(line.find(delimiter, at), line.size());
      cells.push_back(base::trimmed(line.substr(at, end - at)));
      if (end == line.size()) return true;
      at = end + 1;
      continue;
    }
    std::size_t close = start + 1;
    bool doubled = false;
    while (true) {
      close = line.find('"', close);
      if (close == std::string_view::npos) {
        if (open != nullptr) *open = start;
        return false;
      }
      if (close + 1 >= line.size() || line[close + 1] != '"') break;
      doubled = true;
      close += 2;
    }
    const std::string_view inside = line.substr(start + 1, close - start - 1);
    if (doubled) {
      // Views into a growing vector would dangle: the place is found again below.
      std::string text;
      for (std::size_t k = 0; k < inside.size(); ++k) {
        text += inside[k];
        if (inside[k] == '"') ++k;
      }
      if (undone.capacity() == 0) undone.reserve(line.size() / 2 + 1);
      undone.push_back(std::move(text));
      cells.push_back(base::trimmed(undone.back()));
    } else {
      cells.push_back(base::trimmed(inside));
    }
    const std::size_t end = line.find(delimiter, close + 1);
    if (end == std::string_view::npos) return true;
    at = end + 1;
  }
}

}  // namespace loopwarden::record
