// SPDX-License-Identifier: Apache-2.0
#include "model/specialist/judge/classes.hpp"

namespace loopwarden::specialist {
namespace {

constexpr std::array<const char*, kConditions> kConditionNames{
    "no_fault", "stiction", "backlash", "hysteresis", "low_air_supply", "other"};
constexpr std::array<const char*, kVerdicts> kVerdictNames{
    "no_fault",       "stiction", "backlash",           "hysteresis",
    "low_air_supply", "unknown",  "not_enough_movement"};

}  // namespace

const char* to_text(Condition condition) noexcept {
  return kConditionNames[static_cast<std::size_t>(condition)];
}

std::optional<Condition> condition_of(std::string_view name) noexcept {
  for (std::size_t i = 0; i < kKnownConditions; ++i) {
    if (name == kConditionNames[i]) return static_cast<Condition>(i);
  }
  return std::nullopt;
}

const char* to_text(VerdictName verdict) noexcept {
  return kVerdictNames[static_cast<std::size_t>(verdict)];
}

}  // namespace loopwarden::specialist
