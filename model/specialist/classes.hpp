// SPDX-License-Identifier: Apache-2.0
// What specialists answer: the conditions they know, and the verdict on a window.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

namespace loopwarden::specialist {

// `other` is what is wrong with the loop, but not with its valve; no record is called by that name.
enum class Condition : std::uint8_t {
  no_fault,
  stiction,
  backlash,
  hysteresis,
  low_air_supply,
  other
};
inline constexpr std::size_t kConditions = 6;
inline constexpr std::size_t kKnownConditions = 5;  // without `other`
const char* to_text(Condition condition) noexcept;
// Of the known conditions.
std::optional<Condition> condition_of(std::string_view name) noexcept;

// A name, or why there is none: what no specialist explains, and a window that can't tell.
enum class Verdict : std::uint8_t {
  no_fault,
  stiction,
  backlash,
  hysteresis,
  low_air_supply,
  unknown,
  not_enough_movement
};
inline constexpr std::size_t kVerdicts = 7;
const char* to_text(Verdict verdict) noexcept;
constexpr bool names_fault(Verdict v) noexcept {
  return v >= Verdict::stiction && v <= Verdict::low_air_supply;
}

}  // namespace loopwarden::specialist
