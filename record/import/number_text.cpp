// SPDX-License-Identifier: Apache-2.0
#include "record/import/number_text.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <utility>

#include "base/text.hpp"
#include "record/import/units.hpp"

namespace loopwarden::record {
namespace {

// Beginnings of cells for bad values, in lower case, as PI, PHD, Aspen, OPC clients and
// spreadsheets write them.
constexpr std::array<std::string_view, 46> kBadWords{
    "bad",        "no data",     "nodata",      "i/o timeout", "io timeout",    "timeout",
    "nan",        "null",        "n/a",         "none",        "pt created",    "point creat",
    "shutdown",   "comm",        "configure",   "scan off",    "scan time",     "intf shut",
    "no sample",  "no result",   "offline",     "calc",        "error",         "err",
    "over range", "under range", "invalid",     "no lab",      "digital st",    "[-11",
    "inp outr",   "arc off",     "not connect", "out of serv", "not available", "set to bad",
    "no good",    "fail",        "stale",       "undefined",   "unit down",     "device fail",
    "<null",      "(null",       "equip fail",  "not valid",
};
constexpr std::array<std::string_view, 4> kDoubtWords{"questionable", "uncertain", "doubtful",
                                                      "substituted"};

// Blanks, apostrophes and a minus sign that have more than one byte in UTF-8.
constexpr std::array<std::pair<std::string_view, char>, 9> kLongMarks{{{"\u00a0", ' '},
                                                                       {"\u202f", ' '},
                                                                       {"\u2009", ' '},
                                                                       {"\u2007", ' '},
                                                                       {"\u2019", '\''},
                                                                       {"\u02bc", '\''},
                                                                       {"\u2018", '\''},
                                                                       {"\u00b4", '\''},
                                                                       {"\u2212", '-'}}};

// Returns the long mark at the beginning of `text`; kLongMarks.end() if there is none.
auto long_mark(std::string_view text) noexcept {
  return std::find_if(kLongMarks.begin(), kLongMarks.end(),
                      [text](const auto& mark) { return text.starts_with(mark.first); });
}

// Returns `text` with one byte for each mark.
std::string with_short_marks(std::string_view text) {
  std::string out;
  while (!text.empty()) {
    const auto mark =
        static_cast<unsigned char>(text.front()) < 0x80 ? kLongMarks.end() : long_mark(text);
    out += mark == kLongMarks.end() ? text.front() : mark->second;
    text.remove_prefix(mark == kLongMarks.end() ? 1 : mark->first.size());
  }
  return out;
}

bool is_figure(char c) noexcept { return c >= '0' && c <= '9'; }

bool is_thousands_mark(char c, char decimal) noexcept {
  return c != decimal && (c == ',' || c == '.' || c == '\'' || c == ' ');
}

// Returns whether the digit groups are thousands: the last one has three digits; those between
// first and last all have three, or all two as in India (12,34,567).
bool are_groups(const std::vector<std::size_t>& sizes) {
  if (sizes.size() < 2 || sizes.back() != 3 || sizes.front() < 1) return false;
  const auto inner = [&](std::size_t size) {
    return std::all_of(sizes.begin() + 1, sizes.end() - 1,
                       [size](std::size_t one) { return one == size; });
  };
  return (inner(3) && sizes.front() <= 3) || (sizes.size() > 2 && inner(2) && sizes.front() <= 2);
}

// Returns "1,234,567.8" without its marks and with a point; empty if they are no marks of
// thousands.
std::string without_thousands(std::string_view text, char decimal) {
  std::string plain;
  const std::size_t point = std::min(text.find(decimal), text.size());
  char mark = '\0';
  std::vector<std::size_t> groups{0};
  for (std::size_t k = 0; k < text.size(); ++k) {
    const char c = text[k];
    if (k < point && is_thousands_mark(c, decimal)) {
      if (mark != '\0' && c != mark) return {};
      mark = c;
      groups.push_back(0);
      continue;
    }
    if (k < point && is_figure(c)) ++groups.back();
    if (k < point && !is_figure(c) && k > 0) return {};
    plain += c == decimal ? '.' : c;
  }
  return mark == '\0' || are_groups(groups) ? plain : std::string();
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

// Reads numbers with at most one point and no exponent, as in nearly all cells. Numerator and
// denominator are exact doubles, so their quotient is the double nearest to the text, as from_chars
// finds it (W. D. Clinger, PLDI 1990).
bool short_decimal(std::string_view text, char decimal, double& value) noexcept {
  constexpr std::size_t kExactDigits = 15;
  constexpr std::array kPowers{1e0, 1e1, 1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                               1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15};
  const bool negative = text.front() == '-';
  const std::size_t first = negative || text.front() == '+' ? 1 : 0;
  std::uint64_t whole = 0;
  std::size_t digits = 0;
  std::size_t behind = text.size();  // after the point
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
  const bool digit = text.front() == '-' || text.front() == '+' || is_figure(text.front()) ||
                     text.starts_with("\u2212");
  if (!digit || text.size() > 60) return std::nullopt;
  const std::string shorter = with_short_marks(text);
  const std::string plain = without_thousands(base::trimmed(shorter), decimal);
  return plain.empty() ? std::nullopt : plain_number(plain);
}

std::size_t number_end(std::string_view text) noexcept {
  std::size_t end = 0;
  bool digits = false;
  while (end < text.size()) {
    const char c = text[end];
    if (static_cast<unsigned char>(c) >= 0x80) {
      const auto mark = long_mark(text.substr(end));
      if (mark == kLongMarks.end()) break;
      end += mark->first.size();
      continue;
    }
    const bool sign =
        (c == '-' || c == '+') && (end == 0 || text[end - 1] == 'e' || text[end - 1] == 'E');
    const bool power =
        (c == 'e' || c == 'E') && digits && end + 1 < text.size() &&
        (is_figure(text[end + 1]) ||
         (end + 2 < text.size() && text[end + 1] != ' ' && is_figure(text[end + 2])));
    if (!is_figure(c) && !sign && !power && c != '.' && c != ',' && c != '\'' && c != ' ') break;
    digits = digits || is_figure(c);
    ++end;
  }
  return digits ? end : 0;
}

Marks marks_of(std::string_view text) {
  std::string number = with_short_marks(text);
  const std::size_t sign = number.find_first_of("0123456789.,");
  if (sign == number.npos) return Marks::none;
  number.erase(0, sign);
  const bool power = number.find_first_of("eE") != number.npos;
  const auto points = std::count(number.begin(), number.end(), '.');
  const auto commas = std::count(number.begin(), number.end(), ',');
  if (points + commas == 0) return parse_number(text, '.') ? Marks::whole : Marks::none;
  const bool last_is_comma = number.find_last_of(".,") == number.find_last_of(',');
  char decimal = last_is_comma ? ',' : '.';
  // A mark that appears twice is a thousands mark.
  if ((points == 0 && commas > 1) || (commas == 0 && points > 1))
    decimal = last_is_comma ? '.' : ',';
  if (!parse_number(text, decimal)) return Marks::none;
  const std::size_t at = number.find(decimal);
  const bool one = points + commas == 1 && !power && number.find_first_of(" '") == number.npos;
  const bool both =
      one && at >= 1 && at <= 3 && number.size() - at - 1 == 3 && number.front() != '0';
  if (both) return decimal == ',' ? Marks::comma_open : Marks::point_open;
  return decimal == ',' ? Marks::comma_decimal : Marks::point_decimal;
}

CellValue parse_value(std::string_view text, char decimal,
                      const std::vector<std::string>& bad_words) {
  if (text.empty()) return {Cell::empty, 0.0, {}};
  if (const auto value = parse_number(text, decimal)) return {Cell::number, *value, {}};
  if (const WithUnit split = split_cell(text); !split.unit.empty()) {
    if (const auto value = parse_number(split.text, decimal))
      return {Cell::number, *value, split.unit};
  }
  // Errors of spreadsheets in all languages: #VALUE!, #WERT!, #NV, #N/A. A column that was too
  // narrow has #####.
  if (text.front() == '#' && text.find('.') == std::string_view::npos) return {Cell::bad, 0.0, {}};
  if (text == "-" || text == "--" || text == "?" || text == "*") return {Cell::bad, 0.0, {}};
  const auto begins = [&](std::string_view word) { return begins_with(text, word); };
  if (std::any_of(kBadWords.begin(), kBadWords.end(), begins)) return {Cell::bad, 0.0, {}};
  if (begins_with(text, "inf") || begins_with(text, "-inf")) return {Cell::bad, 0.0, {}};
  if (std::any_of(kDoubtWords.begin(), kDoubtWords.end(), begins))
    return {Cell::questionable, 0.0, {}};
  // Historians mark a doubtful number in this way: 12.3?
  if (text.back() == '?' && parse_number(base::trimmed(text.substr(0, text.size() - 1)), decimal)) {
    return {Cell::questionable, 0.0, {}};
  }
  const auto is = [&](const std::string& word) {
    return text.size() == word.size() && begins_with(text, word);
  };
  if (std::any_of(bad_words.begin(), bad_words.end(), is)) return {Cell::bad, 0.0, {}};
  return {Cell::unknown, 0.0, {}};
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
      // Views into a growing vector would dangle, so the positions are found again below.
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
