// SPDX-License-Identifier: Apache-2.0
// Writes a flow for Node-RED with node-red-contrib-modbus. Its tab reads every block of the map,
// decodes the values by name, and can write the writable registers.
#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <vector>

#include "workbench/text/register_map_fields.hpp"
#include "workbench/text/snippets.hpp"

namespace loopwarden::workbench {
namespace {

using nlohmann::json;
using registers::Area;
using registers::Register;
using registers::Table;

constexpr const char* kFlowTab = "lw-tab";
constexpr int kFlowRow = 50;  // pixels between two lines of nodes
constexpr int kReadX = 160;
constexpr int kDecodeX = 430;
constexpr int kShowX = 680;

struct RegisterBlock {
  std::string name;
  Table table;
  std::size_t first;
  std::size_t quantity;
  int seconds;  // between two reads
};

const char* flow_data_type(Table table) {
  switch (table) {
    case Table::coil: return "Coil";
    case Table::discrete_input: return "Input";
    case Table::holding_register: return "HoldingRegister";
    case Table::input_register: break;
  }
  return "InputRegister";
}

void add_loop_blocks(std::vector<RegisterBlock>& blocks, const std::string& tag, std::size_t loop) {
  for (const Table table : kTableOrder) {
    const registers::Layout l = registers::layout(table);
    const bool newest = table == Table::input_register;
    const std::string name = tag + " " + registers::to_text(table) + "s";
    blocks.push_back(
        {name, table, l.first_loop + loop * l.loop_stride, l.loop_stride, newest ? 1 : 5});
    if (l.condition_stride > 0) {
      blocks.push_back({tag + " condition", table, l.first_condition + loop * l.condition_stride,
                        l.condition_stride, 5});
    }
    if (l.third_stride > 0) {
      blocks.push_back({tag + " third block, " + registers::to_text(table) + "s", table,
                        l.first_third + loop * l.third_stride, l.third_stride, 5});
    }
  }
}

std::vector<RegisterBlock> blocks_of(const MapOptions& options) {
  std::vector<RegisterBlock> blocks;
  for (const Table table : kTableOrder) {
    blocks.push_back({std::string("box ") + registers::to_text(table) + "s", table, 0,
                      registers::layout(table).box_size, 5});
  }
  for (std::size_t loop = 0; loop < options.loops.size(); ++loop)
    add_loop_blocks(blocks, options.loops[loop], loop);
  return blocks;
}

// Returns a node with the properties that all nodes of its kind share, and its own.
json node(const char* type, const json& own) {
  static const json kinds = json::parse(kNodeRedNodes);
  json made = kinds.at(type);
  made.update(own);
  return made;
}

json flow_node(const std::string& id, const char* type, const std::string& name, int x, int y,
               const json& own = json::object()) {
  json made =
      node(type, {{"id", id}, {"type", type}, {"z", kFlowTab}, {"name", name}, {"x", x}, {"y", y}});
  made.update(own);
  return made;
}

json function_node(const std::string& id, const std::string& name, std::string code, int x, int y,
                   const char* to) {
  return flow_node(id, "function", name, x, y,
                   {{"func", std::move(code)}, {"wires", json::array({json::array({to})})}});
}

json read_node(const MapOptions& options, const RegisterBlock& block, std::size_t number, int y) {
  return flow_node(fmt::format("lw-read-{}", number), "modbus-read", block.name, kReadX, y,
                   {{"unitid", fmt::format("{}", options.unit)},
                    {"dataType", flow_data_type(block.table)},
                    {"adr", fmt::format("{}", block.first)},
                    {"quantity", fmt::format("{}", block.quantity)},
                    {"rate", fmt::format("{}", block.seconds)}});
}

// Returns a node that sends the register's present value. A press has no effect until the user
// enters another value.
json inject_node(const std::string& id, const std::string& owner, const std::string& name, int x,
                 int y) {
  const std::string value = "$lookup($lookup($flowContext(\"loopwarden\"), " + quoted(owner) +
                            "), " + quoted("set/" + name) + ")";
  return flow_node(id, "inject", owner + " " + name, x, y,
                   {{"topic", owner + "/" + name}, {"payload", value}});
}

std::string decode_code(const MapOptions& options) {
  json registers = json::array();
  for_each(options, [&](const Register& reg, const std::string& tag, std::uint32_t address) {
    registers.push_back({read_function(reg.table), address, type_text(reg), reg.scale,
                         owner_of(tag), name_in_owner(reg)});
  });
  return filled(kNodeRedDecode, {{"ORDER", quoted(order_text(options.word_order))},
                                 {"REGISTERS", registers.dump()}});
}

std::string write_code(const MapOptions& options) {
  json writable = json::object();
  for_each(options, [&](const Register& reg, const std::string& tag, std::uint32_t address) {
    if (!registers::writable(reg)) return;
    const int function = is_bit(reg) ? 5 : registers::width(reg) == 2 ? 16 : 6;
    writable[owner_of(tag) + "/" + reg.name] = {function, address, type_text(reg), reg.scale};
  });
  return filled(kNodeRedWrite, {{"ORDER", quoted(order_text(options.word_order))},
                                {"UNIT", fmt::format("{}", options.unit)},
                                {"WRITABLE", writable.dump()}});
}

}  // namespace

std::string map_node_red(const MapOptions& options) {
  json flow = json::array();
  flow.push_back(node("tab", json::object()));
  flow.push_back(node("modbus-client", {{"tcpHost", options.host},
                                        {"tcpPort", fmt::format("{}", options.port)},
                                        {"unit_id", options.unit}}));
  int y = kFlowRow;
  flow.push_back(
      function_node("lw-decode", "values by name", decode_code(options), kDecodeX, y, "lw-values"));
  flow.push_back(flow_node("lw-values", "debug", "values", kShowX, y));
  const std::vector<RegisterBlock> blocks = blocks_of(options);
  for (std::size_t i = 0; i < blocks.size(); ++i, y += kFlowRow)
    flow.push_back(read_node(options, blocks[i], i, y));
  y += kFlowRow;
  flow.push_back(function_node("lw-order", "order", write_code(options), kDecodeX, y, "lw-write"));
  flow.push_back(flow_node("lw-write", "modbus-flex-write", "write", kDecodeX + 140, y));
  flow.push_back(flow_node("lw-written", "debug", "written", kShowX + 60, y));
  flow.push_back(inject_node("lw-acknowledge", "box", "acknowledge_all", kReadX, y));
  for (std::size_t loop = 0; loop < options.loops.size(); ++loop) {
    for (const char* name : {"mode", "sp", "output"}) {
      y += kFlowRow;
      flow.push_back(
          inject_node(fmt::format("lw-{}-{}", name, loop), options.loops[loop], name, kReadX, y));
    }
  }
  return flow.dump(1) + "\n";
}

}  // namespace loopwarden::workbench
