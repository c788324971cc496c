// SPDX-License-Identifier: Apache-2.0
#include "workbench/text/register_map_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "map/register_map.hpp"
#include "workbench/text/register_map_fields.hpp"

namespace loopwarden::workbench {
namespace {

namespace map = register_map;
using hal::modbus::ByteOrder;
using hal::modbus::RegisterType;
using map::Area;
using map::Register;
using map::Table;

// What PLC people call it: 1-based, with the table in front.
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
  for (const Register& reg : map::registers()) {
    if (reg.table != table || reg.area != area) continue;
    text += fmt::format("| {} | `{}` | {} | {} | {} | {} |\n", reg.offset, reg.name, type_text(reg),
                        scale_text(reg), reg.unit, reg.meaning);
  }
}

void reserved_rows(std::string& text, Table table) {
  text +=
      "\nKept for what comes, and 0 until then:\n\n| offset | addresses | what |\n|---|---|---|\n";
  for (const map::Reserved& place : map::reserved()) {
    if (place.table != table) continue;
    text += fmt::format("| {} | {} | {} |\n", place.offset, place.words, place.meaning);
  }
}

constexpr const char* kIntroduction = R"(# Modbus register map

<!-- Generated: loopwarden register-map --format markdown > docs/modbus-map.md -->

Offered by `loopwardend` where `loopwardend.yaml` has a section `modbus_server`
([configuration.md](configuration.md)). Version {}.{}.

- Addresses are those on the wire, from 0. A master that counts from 1 adds 1: input register 14 is 30015 or
  300015 to a PLC.
- 32-bit values (`f32`: IEEE 754, `u32`) take two registers, most significant word first (ABCD), unless
  `word_order` says otherwise. Input registers 14 and 15 always hold 123456.0, which is 0x47F1 0x2000, and 16
  and 17 hold 0x01020304: read them first.
- value = register x scale. Units "PV" and "CO" are the loop's own.
- A float is never NaN: what is not there reads 0 or its last good value and has a quality, a bit or the scaled
  copy's -32768 to say so.
- All registers of one request are of one cycle of the loop. For a block read in two requests, compare
  `sequence_head` and `sequence_tail`.
- Reserved registers read 0. Outside the map: exception 02.
- Alarms are the valve's. Process alarms (`bad_pv`, `output_lost`, `output_unknown`, `not_normal_mode`) have no register:
  they are in no count, and `acknowledge_all` leaves them to who sees them. `pv_quality`, `fault` and `mode` tell the same.
- Functions 1, 2, 3, 4, 5, 6, 15, 16, and 43/14 (device identification).

Writing: exception 01 if writes are off or the client may not write, 02 for a reserved or read-only register,
03 for a value outside its limits or half of a 32-bit value, 06 if the value is right and the loop can't take it
now. A request that writes several registers is done as a whole or not at all; a reserved register between two
fields takes the 0 that it reads. Gains hold until the next reload of the configuration.

**Write mode first, then output.** Exception 06 comes where the order would do nothing:

| written | while | instead |
|---|---|---|
| `output` | the loop is in automatic | write `mode` 0 first, or in the same request |
| `output` | a fault's action has the output | wait until `fault` is 0; while `co_scaled` is -32768, for 3 or 8 |
| `sp` | the loop is in manual and its set point follows PV | write `mode` 1 first, or in the same request |
| `mode` 1 | where the output stands is not known, or a fault that ends in manual is there | write `output` in manual; wait |
| anything | 32 orders to the loop are waiting | a cycle later |

The same value that a register reads can always be written, and then does nothing, but for `output` in manual while
it is not known (`co_scaled` -32768): it reads 0, and 0 written is an order. Of all that one request writes
the gains take effect first, then the mode, then the set point, then the output, in one cycle of the loop; set point
and output are judged by the mode that the request itself asks for. A mode written a moment ago counts, though the
loop may not have taken it yet. Where several order in one cycle, an operator on the box has the last word, then the
master, then the corrective action.

Each write but the heartbeat goes to the journal with peer, old and new value, and with what the loop's cycle made
of it. What was let in and could not act any more when the cycle took it, since an operator or a fault came first, is
refused there, and counted in `orders_refused`.

Loops have the order of their files' names. Loop k, from 0, begins at:

| table | box | loop k |
|---|---|---|
)";

constexpr const char* kThirdRegisters = R"(
Read-only: exception 02 for a write. What the jacket does, in CO/s, and what a compensator does, in CO, have
registers of their own; `jacket_rate` of the first block stays the jacket's.
)";

constexpr const char* kThirdCoils = R"(
None is in use yet.
)";

constexpr const char* kConditions = R"(
100 is as good as can be seen, 0 as bad as counts; -32768 (-327.68) is not known, which is not good. Each is
100 (1 - worst of its values over their limits), from the newest window of the loop (96 s at 10 Hz). In
automatic only: RMS of SP - PV (limit 5 % of the PV span) and stick band (10 % of the CO span), from the read-back
or from a raised stiction, backlash or hysteresis alarm. In every mode: lag of the stem (30 s), mean |CO - stem|
(3 % of the CO span), share of bad read-backs (10 %), of bad PV (10 %), and of cycles that were late, missing or
not delivered (2 %). A raised low_air_supply makes the actuator's 0. Without read-back and without specialists
valve, actuator and positioner are not known.
)";

}  // namespace

std::string map_markdown() {
  std::string text =
      fmt::format(fmt::runtime(kIntroduction), map::kVersion >> 8, map::kVersion & 0xFF);
  for (const Table table : kTableOrder) {
    const map::Layout l = map::layout(table);
    text +=
        fmt::format("| {}s | 0 | {} + {} k |\n", map::to_text(table), l.first_loop, l.loop_stride);
    if (l.condition_stride > 0) {
      text += fmt::format("| {}s, second block | | {} + {} k |\n", map::to_text(table),
                          l.first_condition, l.condition_stride);
    }
    if (l.third_stride > 0) {
      text += fmt::format("| {}s, third block | | {} + {} k |\n", map::to_text(table),
                          l.first_third, l.third_stride);
    }
  }
  for (const Table table : kTableOrder) {
    std::string name = map::to_text(table);
    name[0] = static_cast<char>(name[0] - 'a' + 'A');
    text += fmt::format("\n## {}s of the box\n", name);
    table_rows(text, table, Area::box);
    text += fmt::format("\n## {}s of a loop\n", name);
    table_rows(text, table, Area::loop);
    if (map::layout(table).condition_stride > 0) {
      text += fmt::format("\n## {}s of a loop, second block: condition indices\n", name);
      text += kConditions;
      table_rows(text, table, Area::condition);
    }
    if (map::layout(table).third_stride > 0) {
      text += fmt::format("\n## {}s of a loop, third block\n", name);
      text += table == Table::coil ? kThirdCoils : kThirdRegisters;
      if (table == Table::holding_register) table_rows(text, table, Area::third);
      reserved_rows(text, table);
    }
  }
  return text;
}

std::string map_csv(const MapOptions& options) {
  std::string text = "table,address,plc,loop,name,type,words,scale,unit,access,meaning\n";
  for_each(options, [&](const Register& reg, const std::string& tag, std::uint32_t address) {
    text +=
        fmt::format("{},{},{},{},{},{},{},{},{},{},\"{}\"\n", map::to_text(reg.table), address,
                    plc_number(reg.table, address), tag, reg.name, type_text(reg), map::width(reg),
                    reg.scale, reg.unit, map::writable(reg) ? "rw" : "r", reg.meaning);
  });
  return text;
}

std::string map_pymodbus(const MapOptions& options) {
  const auto swapped =
      options.word_order == ByteOrder::badc || options.word_order == ByteOrder::dcba;
  const auto reversed =
      options.word_order == ByteOrder::cdab || options.word_order == ByteOrder::dcba;
  std::string text =
      fmt::format(R"(#!/usr/bin/env python3
"""Reads every register of a Loopwarden map and prints it as JSON. Runs with pymodbus 3.0 (Debian 12) and later."""
import inspect
import json
import struct
import sys

from pymodbus.client import ModbusTcpClient

HOST, PORT, UNIT = {}, {}, {}
WORDS_REVERSED, BYTES_SWAPPED = {}, {}  # word_order {}
REGISTERS = [
    # table, address, words, type, scale, name
)",
                  quoted(options.host), options.port, options.unit, reversed ? "True" : "False",
                  swapped ? "True" : "False", order_text(options.word_order));
  for_each(options, [&](const Register& reg, const std::string& tag, std::uint32_t address) {
    text += fmt::format("    ({}, {}, {}, {}, {}, {}),\n", quoted(map::to_text(reg.table)), address,
                        map::width(reg), quoted(type_text(reg)), reg.scale,
                        quoted(field_name(reg, tag)));
  });
  text += R"(]


def decode(words, kind):
    """One value of one or two registers."""
    if kind in ("u32", "f32"):
        if WORDS_REVERSED:
            words = words[::-1]
        raw = struct.pack(">HH", *words)
        if BYTES_SWAPPED:
            raw = bytes((raw[1], raw[0], raw[3], raw[2]))
        return struct.unpack(">f" if kind == "f32" else ">I", raw)[0]
    return struct.unpack(">h", struct.pack(">H", words[0]))[0] if kind == "i16" else words[0]


def main():
    host = sys.argv[1] if len(sys.argv) > 1 else HOST
    port = int(sys.argv[2]) if len(sys.argv) > 2 else PORT
    client = ModbusTcpClient(host, port=port)
    if not client.connect():
        sys.exit(f"no connection to {host} port {port}")
    read = {
        "input register": client.read_input_registers,
        "holding register": client.read_holding_registers,
        "discrete input": client.read_discrete_inputs,
        "coil": client.read_coils,
    }
    # The unit's argument has changed its name twice.
    names = inspect.signature(client.read_coils).parameters
    unit = {next((n for n in ("device_id", "slave") if n in names), "slave"): UNIT}
    values = {}
    for table, address, words, kind, scale, name in REGISTERS:
        answer = read[table](address, count=words, **unit)
        if answer.isError():
            sys.exit(f"{name}: {answer}")
        if kind == "bit":
            value = int(answer.bits[0])
        else:
            value = decode(answer.registers, kind) * scale
        values[f"{table}:{name}"] = value
    client.close()
    json.dump(values, sys.stdout, indent=1)
    print()


main()
)";
  return text;
}

nlohmann::json map_json(const MapOptions& options) {
  nlohmann::json registers = nlohmann::json::array();
  for_each(options, [&](const Register& reg, const std::string& tag, unsigned address) {
    registers.push_back({{"table", map::to_text(reg.table)},
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
