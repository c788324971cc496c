// SPDX-License-Identifier: Apache-2.0
// The kind of a loop: the same evidence has different meanings on a flow and on a level.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace loopwarden::diagnosis {

enum class LoopKind : std::uint8_t { unknown, flow, pressure, level, temperature };
const char* to_text(LoopKind kind) noexcept;
std::optional<LoopKind> loop_kind(std::string_view name) noexcept;

// Returns the kind from an ISA-5.1 tag (FIC101, 21-LC-105, PDIC7, TRCA_3). It is the first letter
// of a group of capital letters in which C follows, and then at most S or A. Unknown if no group
// has this form, or if two groups disagree.
LoopKind kind_from_tag(std::string_view tag) noexcept;

}  // namespace loopwarden::diagnosis
