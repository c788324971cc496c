// SPDX-License-Identifier: Apache-2.0
// The numbers that a key permits, and their conversion from text: finite and in decimal notation.
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
  const char* fallback = "";  // text for a default that is no fixed number
  const char* words = "";     // in messages: permitted values that are no numbers, "hold or "
};

struct IntegerRule {
  std::int64_t low = 0;
  std::int64_t high = 0;
  const char* unit = "";
  const char* meaning = "";
  bool hexadecimal = false;  // 0x... is accepted as well
  const char* fallback = "";
  // Returns a sentence to add if the text is refused. May be empty or null.
  std::string (*advice)(std::string_view text) = nullptr;
};

// Returns the rule in the words of the reference and of messages.
std::string to_text(const NumberRule& rule);
std::string to_text(const IntegerRule& rule);
// "> 0 and < 1 s"
std::string with_unit(const Interval& interval, std::string_view unit);

// Returns why `node` is no number; empty if it is one.
std::string fault_of_number(const YamlNode& node, const NumberRule& rule);
// Returns the number of a text without such a fault; infinity if a double can't hold it.
double parse_decimal(std::string_view text);
// Returns whether the text has the form 0x...
bool is_hexadecimal(std::string_view text);

}  // namespace loopwarden::config
