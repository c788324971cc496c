// SPDX-License-Identifier: Apache-2.0
// What the map's texts have in common: the registers of a configuration in the order in which every text has them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <string>
#include <utility>

#include "daemon/registers/register_map.hpp"
#include "workbench/text/register_map_text.hpp"

namespace loopwarden::workbench {

// As the map's documents have them.
inline constexpr std::array kTableOrder{
    registers::Table::input_register, registers::Table::discrete_input,
    registers::Table::holding_register, registers::Table::coil};

const char* type_text(const registers::Register& reg);  // "u16", "f32", "bit"
const char* order_text(hal::modbus::ByteOrder order);      // "abcd"
bool is_bit(const registers::Register& reg) noexcept;   // a coil or a discrete input
int read_function(registers::Table table) noexcept;     // 1 to 4

// Calls `visit(reg, tag, address)` for the box's registers, whose tag is empty, and those of every loop.
using VisitRegister = std::function<void(const registers::Register& reg, const std::string& tag,
                                         std::uint32_t address)>;
void for_each(const MapOptions& options, const VisitRegister& visit);

std::string owner_of(const std::string& tag);  // the tag, or "box"
std::string field_name(const registers::Register& reg, const std::string& tag);  // "FIC-101.pv"
// The name within its owner, which no other has: what can be written has set/ before it, what the third block has once
// more third/.
std::string name_in_owner(const registers::Register& reg);
// A text as JSON, Python and TOML all write it.
std::string quoted(const std::string& text);
// A text as it stands between ' of a shell.
std::string shell_quotable(std::string text);
// `text` with what stands there for each @NAME@.
std::string filled(std::string text,
                   const std::initializer_list<std::pair<std::string, std::string>>& values);

}  // namespace loopwarden::workbench
