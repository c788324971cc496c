// SPDX-License-Identifier: Apache-2.0
#include "config/number_rule.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "base/text.hpp"
#include "config/character.hpp"
#include "config/diagnostic.hpp"

namespace loopwarden::config {
namespace {

// Returns the text without its sign.
std::string_view magnitude(std::string_view text) {
  if (text.starts_with('-') || text.starts_with('+')) text.remove_prefix(1);
  return text;
}

bool has_leading_zero(std::string_view text) {
  text = magnitude(text);
  return text.size() > 1 && text[0] == '0' && is_digit(text[1]);
}

bool is_not_finite(std::string_view text) {
  std::string lower = base::lower_case(magnitude(text));
  if (lower.starts_with('.')) lower.erase(0, 1);
  return lower == "inf" || lower == "nan" || lower == "infinity";
}

// Returns whether the text has only digits, at most one point among them and an optional exponent.
bool is_decimal(std::string_view text) {
  text = magnitude(text);
  std::size_t digits = 0;
  bool point = false;
  std::size_t i = 0;
  for (; i < text.size() && (is_digit(text[i]) || (text[i] == '.' && !point)); ++i) {
    point = point || text[i] == '.';
    digits += is_digit(text[i]) ? 1U : 0U;
  }
  if (digits == 0) return false;
  if (i == text.size()) return true;
  if (text[i] != 'e' && text[i] != 'E') return false;
  const std::string_view exponent = magnitude(text.substr(i + 1));
  return !exponent.empty() && std::all_of(exponent.begin(), exponent.end(), is_digit);
}

}  // namespace

bool Interval::contains(double value) const noexcept {
  return (low_is_open ? value > low : value >= low) &&
         (high_is_open ? value < high : value <= high);
}

std::string to_text(const Interval& interval) {
  std::string text;
  if (interval.low > -kInfinity) {
    text = fmt::format("{} {}", interval.low_is_open ? ">" : ">=", brief(interval.low));
  }
  if (interval.high < kInfinity) {
    text += fmt::format("{}{} {}", text.empty() ? "" : " and ",
                        interval.high_is_open ? "<" : "<=", brief(interval.high));
  }
  return text;
}

std::string brief(double value) { return fmt::format("{:.9g}", value); }

std::string with_unit(double value, std::string_view unit) {
  return unit.empty() ? brief(value) : fmt::format("{} {}", brief(value), unit);
}

std::string with_unit(const Interval& interval, std::string_view unit) {
  const std::string text = to_text(interval);
  return unit.empty() ? text : fmt::format("{}{}{}", text, text.empty() ? "" : " ", unit);
}

std::string to_text(const NumberRule& rule) {
  std::string text = fmt::format("{}number", rule.words);
  const std::string range = to_text(rule.range);
  if (!range.empty()) text += fmt::format(" {}", range);
  if (*rule.unit != '\0') text += fmt::format(", {}", rule.unit);
  return text;
}

std::string to_text(const IntegerRule& rule) {
  std::string text = fmt::format("whole number {} to {}", rule.low, rule.high);
  if (*rule.unit != '\0') text += fmt::format(", {}", rule.unit);
  return text;
}

bool is_hexadecimal(std::string_view text) {
  return magnitude(base::lower_case(text)).starts_with("0x");
}

std::string fault_of_number(const YamlNode& node, const NumberRule& rule) {
  const std::string expected = fmt::format("must be {}a number", rule.words);
  if (node.kind == YamlNode::Kind::nothing) return fmt::format("{} (no value given)", expected);
  if (node.kind != YamlNode::Kind::scalar)
    return fmt::format("{} (got {})", expected, to_text(node.kind));
  const std::string got = quotable(node.text);
  if (node.quoted) return fmt::format("{} (got text in quotes, '{}')", expected, got);
  if (is_not_finite(node.text)) return fmt::format("must be a finite number (got {})", got);
  if (is_hexadecimal(node.text)) {
    return fmt::format("{} in decimal notation (got {})", expected, got);
  }
  if (has_leading_zero(node.text)) {
    return fmt::format("{} without leading zeros, which some read as octal (got {})", expected,
                       got);
  }
  if (is_decimal(node.text)) return {};
  // The usual cause is a unit after the number, "5 s".
  const std::string_view rest = magnitude(node.text);
  if (!rest.empty() && is_digit(rest.front()) && *rule.unit != '\0') {
    return fmt::format("{} only, its unit is {} (got '{}')", expected, rule.unit, got);
  }
  return fmt::format("{} (got '{}')", expected, got);
}

double parse_decimal(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);  // from_chars does not accept a plus sign
  double value = 0.0;
  const auto result = std::from_chars(text.data(), text.data() + text.size(), value);
  return result.ec == std::errc() ? value : kInfinity;
}

}  // namespace loopwarden::config
