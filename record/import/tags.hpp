// SPDX-License-Identifier: Apache-2.0
// Which column or tag is which signal of which loop, from its name alone.
//
//   FIC101.PV  FIC101_OP  /Area1/FIC101/SP  ns=2;s=Area1.FIC101.MV  \\server\FIC101.OUT  FIC101/PID1/PV.CV
//   FIC101 Process Value  pv  "Controller Output (%)"
//
// What it can't do: pair tags of different names (FT101 with FV101). That takes --map or a format file.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace loopwarden::record {

enum class Role : std::uint8_t { pv, sp, co, stem, mode };
inline constexpr std::size_t kRoles = 5;
constexpr std::size_t index_of(Role role) noexcept { return static_cast<std::size_t>(role); }
const char* to_text(Role role) noexcept;
std::optional<Role> role_from_text(std::string_view text) noexcept;

struct TagName {
  std::string loop;  // empty where the name is a role and nothing else
  std::optional<Role> role;
  std::string unit;  // of the name's brackets: "FIC101.PV (m3/h)", "PV [%]"
};
TagName read_tag(std::string_view name);

// Looks like a unit of measurement: %, m3/h, degC, ...
bool is_unit(std::string_view text);

// The signals of one loop by their columns or tags; empty where there is none.
struct LoopSignals {
  std::string tag;
  std::array<std::string, kRoles> names;
  std::array<std::string, kRoles> units;

  bool has(Role role) const noexcept { return !names[index_of(role)].empty(); }
};
// Loops in the order in which they first appear; of two names with one role in one loop the first. Those without
// a PV are in the list too: the caller says what is missing.
std::vector<LoopSignals> find_loops(const std::vector<std::string>& names);

}  // namespace loopwarden::record
