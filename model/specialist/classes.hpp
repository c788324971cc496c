// SPDX-License-Identifier: Apache-2.0
// What specialists answer: the conditions they know, and the verdict on a window.
//
// The order of both is that of files on users' disks and never changes: weights (config/specialists), evidence.
//
// Errors: a name that is none of the known conditions is nothing.
// Limits: it can't two faults at once; how large a fault is (team.hpp has the size).
//
// Source: the five conditions: Sewdass, thesis (Durban University of Technology), chapter 7; `other`,
// `unknown` and `not_enough_movement` are ours.
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
enum class VerdictName : std::uint8_t {
  no_fault,
  stiction,
  backlash,
  hysteresis,
  low_air_supply,
  unknown,
  not_enough_movement
};
inline constexpr std::size_t kVerdicts = 7;
const char* to_text(VerdictName verdict) noexcept;
constexpr bool names_fault(VerdictName v) noexcept {
  return v >= VerdictName::stiction && v <= VerdictName::low_air_supply;
}

}  // namespace loopwarden::specialist
