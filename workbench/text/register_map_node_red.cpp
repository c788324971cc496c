// SPDX-License-Identifier: Apache-2.0
// A flow for Node-RED with node-red-contrib-modbus: a tab on which every block of the map is read, decoded by name and
// shown, and on which what can be written is written.
#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <vector>

#include "workbench/text/register_map_fields.hpp"
#include "workbench/text/snippets.hpp"

namespace loopwarden::workbench {
namespace {

namespace map = register_map;
using map::Area;
using map::Register;
using map::Table;
using nlohmann::json;

constexpr const char* kTab = "lw-tab";
constexpr int kRow = 50;  // pixels between two lines of nodes
constexpr int kLeft = 160;
constexpr int kMiddle = 430;
constexpr int kRight = 680;

struct Block {
  std::string name;
  Table table;
  std::size_t first;
  std::size_t quantity;
  int seconds;  // between two reads
};

const char* data_type(Table table) {
  switch (table) {
    case Table::coil: return "Coil";
    case Table::discrete_input: return "Input";
    case Table::holding_register: return "HoldingRegister";
    case Table::input_register: break;
  }
  return "InputRegister";
}

void add_loop_blocks(std::vector<Block>& blocks, const std::string& tag, std::size_t loop) {
  for (const Table table :
       {Table::input_register, Table::discrete_input, Table::holding_register, Table::coil}) {
    const map::Layout l = map::layout(table);
    const bool newest = table == Table::input_register;
    const std::string name = tag + " " + map::to_text(table) + "s";
    blocks.push_back(
        {name, table, l.first_loop + loop * l.loop_stride, l.loop_stride, newest ? 1 : 5});
    if (l.condition_stride > 0) {
      blocks.push_back({tag + " condition", table, l.first_condition + loop * l.condition_stride,
                        l.condition_stride, 5});
    }
    if (l.third_stride > 0 && table == Table::holding_register) {
      blocks.push_back(
          {tag + " third block", table, l.first_third + loop * l.third_stride, l.third_stride, 5});
    }
  }
}

std::vector<Block> blocks_of(const MapOptions& options) {
  std::vector<Block> blocks;
  for (const Table table :
       {Table::input_register, Table::discrete_input, Table::holding_register, Table::coil}) {
    blocks.push_back({std::string("box ") + map::to_text(table) + "s", table, 0,
                      map::layout(table).box_size, 5});
  }
  for (std::size_t loop = 0; loop < options.loops.size(); ++loop)
    add_loop_blocks(blocks, options.loops[loop], loop);
  return blocks;
}

json node(const std::string& id, const char* type, const std::string& name, int x, int y) {
  return {{"id", id}, {"type", type}, {"z", kTab}, {"name", name}, {"x", x}, {"y", y}};
}

json function_node(const std::string& id, const std::string& name, std::string code, int x, int y,
                   const char* to) {
  json made = node(id, "function", name, x, y);
  made.update({{"func", std::move(code)},
               {"outputs", 1},
               {"noerr", 0},
               {"initialize", ""},
               {"finalize", ""},
               {"libs", json::array()},
               {"wires", json::array({json::array({to})})}});
  return made;
}

json client(const MapOptions& options) {
  return {{"id", "lw-client"},
          {"type", "modbus-client"},
          {"name", "Loopwarden"},
          {"clienttype", "tcp"},
          {"bufferCommands", true},
          {"stateLogEnabled", false},
          {"queueLogEnabled", false},
          {"failureLogEnabled", true},
          {"tcpHost", options.host},
          {"tcpPort", fmt::format("{}", options.port)},
          {"tcpType", "DEFAULT"},
          {"serialPort", "/dev/ttyUSB"},
          {"serialType", "RTU-BUFFERD"},
          {"serialBaudrate", "9600"},
          {"serialDatabits", "8"},
          {"serialStopbits", "1"},
          {"serialParity", "none"},
          {"serialConnectionDelay", "100"},
          {"serialAsciiResponseStartDelimiter", "0x3A"},
          {"unit_id", options.unit},
          {"commandDelay", 1},
          {"clientTimeout", 1000},
          {"reconnectOnTimeout", true},
          {"reconnectTimeout", 2000},
          {"parallelUnitIdsAllowed", true}};
}

json read_node(const MapOptions& options, const Block& block, std::size_t number, int y) {
  json made = node(fmt::format("lw-read-{}", number), "modbus-read", block.name, kLeft, y);
  made.update({{"topic", ""},
               {"showStatusActivities", false},
               {"logIOActivities", false},
               {"showErrors", true},
               {"unitid", fmt::format("{}", options.unit)},
               {"dataType", data_type(block.table)},
               {"adr", fmt::format("{}", block.first)},
               {"quantity", fmt::format("{}", block.quantity)},
               {"rate", fmt::format("{}", block.seconds)},
               {"rateUnit", "s"},
               {"delayOnStart", false},
               {"startDelayTime", ""},
               {"server", "lw-client"},
               {"useIOFile", false},
               {"ioFile", ""},
               {"useIOForPayload", false},
               {"emptyMsgOnFail", false},
               {"wires", {{"lw-decode"}, json::array()}}});
  return made;
}

json debug_node(const char* id, const char* name, int x, int y) {
  json made = node(id, "debug", name, x, y);
  made.update({{"active", false},
               {"tosidebar", true},
               {"console", false},
               {"tostatus", false},
               {"complete", "true"},
               {"targetType", "full"},
               {"statusVal", ""},
               {"statusType", "auto"},
               {"wires", json::array()}});
  return made;
}

// Sends what the register reads now: a press changes nothing until somebody puts a value of his own in its place.
json inject_node(const std::string& id, const std::string& owner, const std::string& name, int x,
                 int y) {
  json made = node(id, "inject", owner + " " + name, x, y);
  const std::string value = "$lookup($lookup($flowContext(\"loopwarden\"), " + quoted(owner) +
                            "), " + quoted("set/" + name) + ")";
  made.update({{"props", {{{"p", "payload"}}, {{"p", "topic"}, {"vt", "str"}}}},
               {"repeat", ""},
               {"crontab", ""},
               {"once", false},
               {"onceDelay", 0.1},
               {"topic", owner + "/" + name},
               {"payload", value},
               {"payloadType", "jsonata"},
               {"wires", json::array({json::array({"lw-order"})})}});
  return made;
}

json write_node(int x, int y) {
  json made = node("lw-write", "modbus-flex-write", "write", x, y);
  made.update({{"showStatusActivities", false},
               {"showErrors", true},
               {"server", "lw-client"},
               {"emptyMsgOnFail", false},
               {"keepMsgProperties", false},
               {"wires", {{"lw-written"}, json::array()}}});
  return made;
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
    if (!map::writable(reg)) return;
    const int function = is_bit(reg) ? 5 : map::width(reg) == 2 ? 16 : 6;
    writable[owner_of(tag) + "/" + reg.name] = {function, address, type_text(reg), reg.scale};
  });
  return filled(kNodeRedWrite, {{"ORDER", quoted(order_text(options.word_order))},
                                {"UNIT", fmt::format("{}", options.unit)},
                                {"WRITABLE", writable.dump()}});
}

}  // namespace

std::string map_node_red(const MapOptions& options) {
  json flow = json::array();
  flow.push_back(
      {{"id", kTab},
       {"type", "tab"},
       {"label", "Loopwarden"},
       {"disabled", false},
       {"info",
        "Made by loopwarden register-map --format node-red. Needs node-red-contrib-modbus 5.23."}});
  flow.push_back(client(options));
  int y = kRow;
  flow.push_back(
      function_node("lw-decode", "values by name", decode_code(options), kMiddle, y, "lw-values"));
  flow.push_back(debug_node("lw-values", "values", kRight, y));
  const std::vector<Block> blocks = blocks_of(options);
  for (std::size_t i = 0; i < blocks.size(); ++i, y += kRow)
    flow.push_back(read_node(options, blocks[i], i, y));
  y += kRow;
  flow.push_back(function_node("lw-order", "order", write_code(options), kMiddle, y, "lw-write"));
  flow.push_back(write_node(kMiddle + 140, y));
  flow.push_back(debug_node("lw-written", "written", kRight + 60, y));
  flow.push_back(inject_node("lw-acknowledge", "box", "acknowledge_all", kLeft, y));
  for (std::size_t loop = 0; loop < options.loops.size(); ++loop) {
    for (const char* name : {"mode", "sp", "output"}) {
      y += kRow;
      flow.push_back(
          inject_node(fmt::format("lw-{}-{}", name, loop), options.loops[loop], name, kLeft, y));
    }
  }
  return flow.dump(1) + "\n";
}

}  // namespace loopwarden::workbench
