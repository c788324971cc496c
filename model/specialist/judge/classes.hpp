// SPDX-License-Identifier: Apache-2.0
// The output of the specialists: the conditions that they know, and the verdict on a window.
//
// The order of both enums is that of files on users' disks (weights in config/specialists,
// evidence). It never changes.
//
// Errors: condition_of() returns no value for an unknown name.
// Limits: one fault at a time; team.hpp has the size of a fault.
//
// Source: the five conditions: Sewdass, thesis (Durban University of Technology), chapter 7;
// `other`, `unknown` and `not_enough_movement` are ours.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

namespace loopwarden::specialist {

// `other` is a fault of the loop outside its valve. No record has this name.
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
// Returns the known condition with this name.
std::optional<Condition> condition_of(std::string_view name) noexcept;

// The name of a condition, or the reason for its absence: no specialist explains the window, or
// the window has too little movement.
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
