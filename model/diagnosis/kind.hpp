// SPDX-License-Identifier: Apache-2.0
// What a loop controls: the same evidence means different things on a flow and on a level.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace loopwarden::diagnosis {

enum class LoopKind : std::uint8_t { unknown, flow, pressure, level, temperature };
const char* to_text(LoopKind kind) noexcept;
std::optional<LoopKind> loop_kind(std::string_view name) noexcept;

// From a tag as ISA-5.1 writes it (FIC101, 21-LC-105, PDIC7, TRCA_3): the first letter of a capital letter group that has
// a C behind it, and after that at most S or A. Unknown where no group reads so, or two groups disagree.
LoopKind kind_from_tag(std::string_view tag) noexcept;

}  // namespace loopwarden::diagnosis
