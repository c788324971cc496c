// SPDX-License-Identifier: Apache-2.0
// Common functions for the texts of the register map: the registers of a configuration in a fixed
// order.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <string>
#include <utility>

#include "daemon/registers/register_map.hpp"
#include "workbench/text/register_map_text.hpp"

namespace loopwarden::workbench {

// The order of the tables in all documents.
inline constexpr std::array kTableOrder{registers::Table::input_register,
                                        registers::Table::discrete_input,
                                        registers::Table::holding_register, registers::Table::coil};

const char* type_text(const registers::Register& reg);  // "u16", "f32", "bit"
const char* order_text(hal::modbus::ByteOrder order);   // "abcd"
bool is_bit(const registers::Register& reg) noexcept;   // a coil or a discrete input
int read_function(registers::Table table) noexcept;     // 1 to 4

// Calls `visit(reg, tag, address)` for the registers of the box, with an empty tag, and those of
// every loop.
using VisitRegister = std::function<void(const registers::Register& reg, const std::string& tag,
                                         std::uint32_t address)>;
void for_each(const MapOptions& options, const VisitRegister& visit);

std::string owner_of(const std::string& tag);  // the tag, or "box"
std::string field_name(const registers::Register& reg, const std::string& tag);  // "FIC-101.pv"
// Returns the unique name within the owner. Writable registers have the prefix set/, registers of
// the third block third/.
std::string name_in_owner(const registers::Register& reg);
// Returns a text in quotes, in a form that is valid in JSON, Python and TOML.
std::string quoted(const std::string& text);
// Returns a text for use between single quotes of a shell.
std::string shell_quotable(std::string text);
// Returns `text` with each @NAME@ replaced by its value.
std::string filled(std::string text,
                   const std::initializer_list<std::pair<std::string, std::string>>& values);

}  // namespace loopwarden::workbench
