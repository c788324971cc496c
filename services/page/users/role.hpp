// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

namespace loopwarden::page {

// Each role includes the rights of the one before. Viewers look, operators acknowledge, shelve and
// (if permitted) set values, engineers tune.
enum class Role : std::uint8_t { none, viewer, operator_, engineer };

constexpr std::array<std::string_view, 4> kRoleNames{"none", "viewer", "operator", "engineer"};

constexpr std::string_view to_text(Role role) noexcept {
  return kRoleNames[static_cast<std::size_t>(role)];
}

// Returns nullopt for "none" and for unknown names.
constexpr std::optional<Role> role_of(std::string_view name) noexcept {
  for (std::size_t i = 1; i < kRoleNames.size(); ++i) {
    if (name == kRoleNames[i]) return static_cast<Role>(i);
  }
  return std::nullopt;
}

}  // namespace loopwarden::page
