// SPDX-License-Identifier: Apache-2.0
// Which numbers may stand at a key, and how a text is read as one: finite and in decimal notation.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <string_view>

#include "config/yaml_document.hpp"

namespace loopwarden::config {

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Interval {
  double low = -kInfinity;
  double high = kInfinity;
  bool low_is_open = false;
  bool high_is_open = false;

  bool contains(double value) const noexcept;
};

constexpr Interval any_number() { return {}; }
constexpr Interval above(double low) { return {.low = low, .low_is_open = true}; }
constexpr Interval at_least(double low) { return {.low = low}; }
constexpr Interval between(double low, double high) { return {.low = low, .high = high}; }

std::string to_text(const Interval& interval);               // "> 0 and < 1", or ""
std::string brief(double value);                             // nine digits at most
std::string with_unit(double value, std::string_view unit);  // "0.3 s"

struct NumberRule {
  const char* unit = "";  // empty: a pure number
  Interval range{};
  const char* meaning = "";
  const char* fallback = "";  // in words, where the default is no fixed number
  const char* words = "";     // in messages: what may stand there besides a number, "hold or "
};

struct IntegerRule {
  std::int64_t low = 0;
  std::int64_t high = 0;
  const char* unit = "";
  const char* meaning = "";
  bool hexadecimal = false;  // 0x... is accepted as well
  const char* fallback = "";
  // A sentence to add where the text is refused; empty: none.
  std::string (*advice)(std::string_view text) = nullptr;
};

// In words, as the reference and messages have it.
std::string to_text(const NumberRule& rule);
std::string to_text(const IntegerRule& rule);
// "> 0 and < 1 s"
std::string with_unit(const Interval& interval, std::string_view unit);

// Why `node` is no number; empty if it is one.
std::string fault_of_number(const YamlNode& node, const NumberRule& rule);
// Of a text without such a fault; infinity if it is beyond what a double can hold.
double parse_decimal(std::string_view text);
// 0x...
bool is_hexadecimal(std::string_view text);

}  // namespace loopwarden::config
