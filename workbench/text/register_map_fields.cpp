// SPDX-License-Identifier: Apache-2.0
#include "workbench/text/register_map_fields.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string_view>

namespace loopwarden::workbench {

using hal::modbus::ByteOrder;
using hal::modbus::RegisterType;
using registers::Area;
using registers::Register;
using registers::Table;

const char* type_text(const Register& reg) {
  if (is_bit(reg)) return "bit";
  switch (reg.type) {
    case RegisterType::i16: return "i16";
    case RegisterType::u32: return "u32";
    case RegisterType::f32: return "f32";
    case RegisterType::i32: return "i32";
    case RegisterType::f64: return "f64";
    case RegisterType::u16: break;
  }
  return "u16";
}

const char* order_text(ByteOrder order) {
  switch (order) {
    case ByteOrder::abcd: return "abcd";
    case ByteOrder::cdab: return "cdab";
    case ByteOrder::badc: return "badc";
    case ByteOrder::dcba: break;
  }
  return "dcba";
}

bool is_bit(const Register& reg) noexcept {
  return reg.table == Table::discrete_input || reg.table == Table::coil;
}

int read_function(Table table) noexcept {
  switch (table) {
    case Table::coil: return 1;
    case Table::discrete_input: return 2;
    case Table::holding_register: return 3;
    case Table::input_register: break;
  }
  return 4;
}

void for_each(const MapOptions& options, const VisitRegister& visit) {
  for (const Table table : kTableOrder) {
    for (const Register& reg : registers::registers()) {
      if (reg.table == table && reg.area == Area::box) visit(reg, "", registers::address(reg, 0));
    }
    for (std::size_t loop = 0; loop < options.loops.size(); ++loop) {
      for (const Register& reg : registers::registers()) {
        if (reg.table == table && reg.area != Area::box) {
          visit(reg, options.loops[loop], registers::address(reg, loop));
        }
      }
    }
  }
}

std::string owner_of(const std::string& tag) { return tag.empty() ? "box" : tag; }

std::string field_name(const Register& reg, const std::string& tag) {
  return owner_of(tag) + "." + reg.name;
}

std::string name_in_owner(const Register& reg) {
  if (registers::writable(reg)) return std::string("set/") + reg.name;
  const bool again = std::any_of(registers::registers().begin(), registers::registers().end(),
                                 [&](const Register& other) {
                                   return other.area == Area::loop && !registers::writable(other) &&
                                          std::string_view(other.name) == reg.name;
                                 });
  return (again && reg.area == Area::third ? "third/" : "") + std::string(reg.name);
}

std::string quoted(const std::string& text) { return nlohmann::json(text).dump(); }

std::string shell_quotable(std::string text) {
  constexpr std::string_view kEscaped = "'\\''";
  for (std::size_t at = text.find('\''); at != std::string::npos;
       at = text.find('\'', at + kEscaped.size())) {
    text.replace(at, 1, kEscaped);
  }
  return text;
}

std::string filled(std::string text,
                   const std::initializer_list<std::pair<std::string, std::string>>& values) {
  for (const auto& [name, value] : values) {
    const std::string mark = '@' + name + '@';
    for (std::size_t at = text.find(mark); at != std::string::npos;
         at = text.find(mark, at + value.size())) {
      text.replace(at, mark.size(), value);
    }
  }
  return text;
}

}  // namespace loopwarden::workbench
