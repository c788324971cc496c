// SPDX-License-Identifier: Apache-2.0
// The type of a loop: the same evidence has different meanings on a flow and on a level.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace loopwarden::diagnosis {

enum class LoopType : std::uint8_t { unknown, flow, pressure, level, temperature };
const char* to_text(LoopType type) noexcept;
std::optional<LoopType> loop_type(std::string_view name) noexcept;

// Returns the type from an ISA-5.1 tag (FIC101, 21-LC-105, PDIC7, TRCA_3). It is the first letter
// of a group of capital letters in which C follows, and then at most S or A. Unknown if no group
// has this form, or if two groups disagree.
LoopType loop_type_from_tag(std::string_view tag) noexcept;

}  // namespace loopwarden::diagnosis
