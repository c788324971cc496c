// SPDX-License-Identifier: Apache-2.0
// Assigns columns or tags to signals of loops, from their names only.
//
//   FIC101.PV  FIC101_OP  /Area1/FIC101/SP  ns=2;s=Area1.FIC101.MV  \\server\FIC101.OUT
//   FIC101/PID1/PV.CV  FIC101 Process Value  pv  "Controller Output (%)"
//
// Tags of different names (FT101, FV101) are not combined to a loop here, because this would be a
// guess. The caller suggests it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace loopwarden::record {

enum class Role : std::uint8_t { pv, sp, co, stem, mode };
inline constexpr std::size_t kRoles = 5;
constexpr std::size_t index_of(Role role) noexcept { return static_cast<std::size_t>(role); }
const char* to_text(Role role) noexcept;
std::optional<Role> role_from_text(std::string_view text) noexcept;

struct TagName {
  std::string loop;  // empty if the name is only a role
  std::optional<Role> role;
  std::string unit;  // "FIC101.PV (m3/h)", "PV [%]", "FIC101/PID1/PV.CV GPM"
};
TagName read_tag(std::string_view name);

// A name by ISA-5.1, whose first letter is the measured variable: 12-FIT-129A is "12-", F, IT,
// "-129A". nullopt if no number follows the last two capitals.
struct InstrumentName {
  std::string_view before;
  char measured = 0;
  std::string_view function;
  std::string_view number;

  bool is_transmitter() const noexcept;  // T, IT, I
  bool is_valve() const noexcept;        // V, CV
  bool is_controller() const noexcept;   // C, IC, RC
};
std::optional<InstrumentName> instrument_name(std::string_view name);

using SignalRange = std::pair<double, double>;  // lower end, upper end

// A site's words for modes, in lower case. A loop in cascade counts as controlled by the system.
struct ModeWords {
  std::vector<std::string> automatic{}, manual{}, cascade{};

  // Returns the mode as parse_mode() does. parse_mode() also reads all other words.
  double read(std::string_view text) const;
};

// The signals of one loop by their columns or tags; empty if missing.
struct LoopSignals {
  std::string tag;
  std::array<std::string, kRoles> names;
  std::array<std::string, kRoles> units;
  // Properties set by the site's rules (tag_rules.hpp).
  std::array<std::string, kRoles> ruled_by{};  // FILE:LINE of the rule
  std::array<std::optional<SignalRange>, kRoles> ranges{};
  std::string kind{};  // argument of diagnosis::loop_type(); empty: from the tag
  std::shared_ptr<const ModeWords> mode_words{};

  bool has(Role role) const noexcept { return !names[index_of(role)].empty(); }
};
// Returns all members as text, to compare two of them.
std::string fingerprint(const LoopSignals& signals);

}  // namespace loopwarden::record
