// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "workbench/text/register_map_fields.hpp"

namespace loopwarden::workbench {
namespace {

using hal::modbus::ByteOrder;
using hal::modbus::RegisterType;
using registers::Register;
using registers::Table;

const char* telegraf_register(Table table) {
  switch (table) {
    case Table::coil: return "coil";
    case Table::discrete_input: return "discrete";
    case Table::holding_register: return "holding";
    case Table::input_register: break;
  }
  return "input";
}

std::string telegraf_type(const Register& reg) {
  if (is_bit(reg)) return "";
  switch (reg.type) {
    case RegisterType::i16: return R"(, type = "INT16")";
    case RegisterType::u32: return R"(, type = "UINT32")";
    case RegisterType::f32: return R"(, type = "FLOAT32")";
    default: return R"(, type = "UINT16")";
  }
}

std::string upper_case(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](char c) { return static_cast<char>(c - 'a' + 'A'); });
  return text;
}

// Returns a field's name in a form that InfluxDB and Grafana accept without quotes.
std::string telegraf_field(const Register& reg) {
  std::string name = name_in_owner(reg);
  std::replace(name.begin(), name.end(), '/', '_');
  return name;
}

}  // namespace

std::string map_telegraf(const MapOptions& options) {
  std::string text = fmt::format(
      R"(# Telegraf 1.28 or later. Measurement "loopwarden", a tag "loop" for each loop and the box.
[[inputs.modbus]]
  name = "loopwarden"
  timeout = "1s"
  controller = "tcp://{}:{}"
  configuration_type = "metric"
)",
      options.host, options.port);
  // 16-bit registers are equal in every word order without byte swaps. They have a separate
  // section.
  std::vector<std::string> owners;
  std::map<std::pair<std::string, bool>, std::string> fields;  // by owner and whether 32 bits
  for_each(options, [&](const Register& reg, const std::string& tag, std::uint32_t address) {
    const std::string owner = owner_of(tag);
    if (std::find(owners.begin(), owners.end(), owner) == owners.end()) owners.push_back(owner);
    const std::string scale =
        reg.scale == 1.0 ? "" : fmt::format(R"(, scale = {}, output = "FLOAT64")", reg.scale);
    fields[{owner, registers::width(reg) == 2}] +=
        fmt::format("      {{ register = {}, address = {}, name = {}{}{} }},\n",
                    quoted(telegraf_register(reg.table)), address, quoted(telegraf_field(reg)),
                    telegraf_type(reg), scale);
  });
  for (const std::string& owner : owners) {
    for (const bool wide : {false, true}) {
      const auto section = fields.find({owner, wide});
      if (section == fields.end()) continue;
      text += fmt::format(
          "\n  [[inputs.modbus.metric]]\n    slave_id = {}\n    byte_order = {}\n    measurement = "
          "\"loopwarden\"\n    fields = [\n{}    ]\n    [inputs.modbus.metric.tags]\n      loop = "
          "{}\n",
          options.unit, quoted(wide ? upper_case(order_text(options.word_order)) : "ABCD"),
          section->second, quoted(owner));
    }
  }
  return text;
}

}  // namespace loopwarden::workbench
