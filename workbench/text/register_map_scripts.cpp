// SPDX-License-Identifier: Apache-2.0
// Writes scripts that read the whole map, for mbpoll and for modbus-serial of npm.
#include <fmt/format.h>

#include "workbench/text/register_map_fields.hpp"
#include "workbench/text/snippets.hpp"

namespace loopwarden::workbench {
namespace {

using hal::modbus::ByteOrder;
using hal::modbus::RegisterType;
using registers::Register;
using registers::Table;

// Returns the argument of mbpoll's -t.
std::string mbpoll_type(const Register& reg) {
  if (is_bit(reg)) return reg.table == Table::coil ? "0" : "1";
  std::string type = reg.table == Table::holding_register ? "4" : "3";
  if (reg.type == RegisterType::f32) type += ":float";
  if (reg.type == RegisterType::u32) type += ":int";
  return type;
}

}  // namespace

std::string map_mbpoll(const MapOptions& options) {
  // mbpoll reads ABCD with -B and CDAB without. It has no option for the other orders.
  const bool known = options.word_order == ByteOrder::abcd || options.word_order == ByteOrder::cdab;
  const char* const big = options.word_order == ByteOrder::abcd ? " -B" : "";
  std::string text = filled(kReadScript, {{"HOST", options.host},
                                          {"PORT", fmt::format("{}", options.port)},
                                          {"UNIT", fmt::format("{}", options.unit)}});
  if (!known) {
    text += fmt::format("# mbpoll can't read word order {}; 32-bit values are left out.\n",
                        order_text(options.word_order));
  }
  for_each(options, [&](const Register& reg, const std::string& tag, std::uint32_t address) {
    const bool wide = registers::width(reg) == 2;
    if (wide && !known) return;
    text += fmt::format("read_one '{}:{}' {} {:g} -t {} -r {}{}\n", registers::to_text(reg.table),
                        shell_quotable(field_name(reg, tag)), type_text(reg), reg.scale,
                        mbpoll_type(reg), address, wide ? big : "");
  });
  return text + "exit $failed\n";
}

std::string map_javascript(const MapOptions& options) {
  std::string registers = "[\n";
  for_each(options, [&](const Register& reg, const std::string& tag, std::uint32_t address) {
    registers += fmt::format("  [{}, {}, {}, {}, {}, {}],\n", quoted(registers::to_text(reg.table)),
                             address, registers::width(reg), quoted(type_text(reg)), reg.scale,
                             quoted(field_name(reg, tag)));
  });
  return filled(kReadJavaScript, {{"HOST", quoted(options.host)},
                                  {"PORT", fmt::format("{}", options.port)},
                                  {"UNIT", fmt::format("{}", options.unit)},
                                  {"ORDER", quoted(order_text(options.word_order))},
                                  {"REGISTERS", registers + "]"}});
}

}  // namespace loopwarden::workbench
