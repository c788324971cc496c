// SPDX-License-Identifier: Apache-2.0
#include "workbench/text/register_map_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>

#include "daemon/registers/register_map.hpp"
#include "workbench/text/register_map_fields.hpp"
#include "workbench/text/snippets.hpp"

namespace loopwarden::workbench {
namespace {

using hal::modbus::ByteOrder;
using hal::modbus::RegisterType;
using registers::Area;
using registers::Register;
using registers::Table;

// Returns the number of a register in PLC notation: 1-based, with the table in front.
std::uint32_t plc_number(Table table, std::uint32_t address) {
  switch (table) {
    case Table::input_register: return 300'001 + address;
    case Table::holding_register: return 400'001 + address;
    case Table::discrete_input: return 100'001 + address;
    case Table::coil: break;
  }
  return 1 + address;
}

std::string scale_text(const Register& reg) {
  return reg.scale == 1.0 ? std::string() : fmt::format("{:g}", reg.scale);
}

void table_rows(std::string& text, Table table, Area area) {
  text += "\n| offset | name | type | scale | unit | meaning |\n|---|---|---|---|---|---|\n";
  for (const Register& reg : registers::registers()) {
    if (reg.table != table || reg.area != area) continue;
    text += fmt::format("| {} | `{}` | {} | {} | {} | {} |\n", reg.offset, reg.name, type_text(reg),
                        scale_text(reg), reg.unit, reg.meaning);
  }
}

void reserved_rows(std::string& text, Table table) {
  text += "\nReserved, 0 at present:\n\n| offset | addresses | what |\n|---|---|---|\n";
  for (const registers::Reserved& place : registers::reserved()) {
    if (place.table != table) continue;
    text += fmt::format("| {} | {} | {} |\n", place.offset, place.words, place.meaning);
  }
}

}  // namespace

std::string map_markdown() {
  std::string text = filled(
      kMapIntroduction,
      {{"VERSION", fmt::format("{}.{}", registers::kVersion >> 8, registers::kVersion & 0xFF)}});
  for (const Table table : kTableOrder) {
    const registers::Layout l = registers::layout(table);
    text += fmt::format("| {}s | 0 | {} + {} k |\n", registers::to_text(table), l.first_loop,
                        l.loop_stride);
    if (l.condition_stride > 0) {
      text += fmt::format("| {}s, second block | | {} + {} k |\n", registers::to_text(table),
                          l.first_condition, l.condition_stride);
    }
    if (l.third_stride > 0) {
      text += fmt::format("| {}s, third block | | {} + {} k |\n", registers::to_text(table),
                          l.first_third, l.third_stride);
    }
  }
  for (const Table table : kTableOrder) {
    std::string name = registers::to_text(table);
    name[0] = static_cast<char>(name[0] - 'a' + 'A');
    text += fmt::format("\n## {}s of the box\n", name);
    table_rows(text, table, Area::box);
    text += fmt::format("\n## {}s of a loop\n", name);
    table_rows(text, table, Area::loop);
    if (registers::layout(table).condition_stride > 0) {
      text += fmt::format("\n## {}s of a loop, second block: condition indices\n", name);
      text += kMapConditions;
      table_rows(text, table, Area::condition);
    }
    if (registers::layout(table).third_stride > 0) {
      text += fmt::format("\n## {}s of a loop, third block\n", name);
      if (table == Table::holding_register) text += kMapThirdRegisters;
      table_rows(text, table, Area::third);
      if (table == Table::holding_register) reserved_rows(text, table);
    }
  }
  return text;
}

std::string map_csv(const MapOptions& options) {
  std::string text = "table,address,plc,loop,name,type,words,scale,unit,access,meaning\n";
  for_each(options, [&](const Register& reg, const std::string& tag, std::uint32_t address) {
    text += fmt::format("{},{},{},{},{},{},{},{},{},{},\"{}\"\n", registers::to_text(reg.table),
                        address, plc_number(reg.table, address), tag, reg.name, type_text(reg),
                        registers::width(reg), reg.scale, reg.unit,
                        registers::writable(reg) ? "rw" : "r", reg.meaning);
  });
  return text;
}

std::string map_pymodbus(const MapOptions& options) {
  const auto swapped =
      options.word_order == ByteOrder::badc || options.word_order == ByteOrder::dcba;
  const auto reversed =
      options.word_order == ByteOrder::cdab || options.word_order == ByteOrder::dcba;
  std::string registers;
  for_each(options, [&](const Register& reg, const std::string& tag, std::uint32_t address) {
    registers += fmt::format("    ({}, {}, {}, {}, {}, {}),\n",
                             quoted(registers::to_text(reg.table)), address, registers::width(reg),
                             quoted(type_text(reg)), reg.scale, quoted(field_name(reg, tag)));
  });
  return filled(kReadPython, {{"HOST", quoted(options.host)},
                              {"PORT", fmt::format("{}", options.port)},
                              {"UNIT", fmt::format("{}", options.unit)},
                              {"WORDS_REVERSED", reversed ? "True" : "False"},
                              {"BYTES_SWAPPED", swapped ? "True" : "False"},
                              {"ORDER", order_text(options.word_order)},
                              {"REGISTERS", registers}});
}

nlohmann::json map_json(const MapOptions& options) {
  nlohmann::json registers = nlohmann::json::array();
  for_each(options, [&](const Register& reg, const std::string& tag, unsigned address) {
    registers.push_back({{"table", registers::to_text(reg.table)},
                         {"address", address},
                         {"loop", tag},
                         {"name", reg.name},
                         {"type", type_text(reg)},
                         {"scale", reg.scale},
                         {"unit", reg.unit},
                         {"meaning", reg.meaning}});
  });
  return {{"host", options.host},
          {"port", options.port},
          {"unit", options.unit},
          {"word_order", order_text(options.word_order)},
          {"registers", std::move(registers)}};
}

}  // namespace loopwarden::workbench
