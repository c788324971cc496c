// SPDX-License-Identifier: Apache-2.0
#include "daemon/console/registers.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include <nlohmann/json.hpp>

#include "daemon/console/compact_text.hpp"
#include "daemon/console/plant_readings.hpp"
#include "daemon/console/request.hpp"

namespace loopwarden::daemon::console {
namespace {

namespace map = register_map;
using hal::modbus::RegisterType;
using map::Register;
using map::Table;

constexpr int kDigits = 9;  // of a float: all that the registers hold

const char* short_name(Table table) {
  switch (table) {
    case Table::input_register: return "input";
    case Table::holding_register: return "holding";
    case Table::discrete_input: return "discrete";
    case Table::coil: break;
  }
  return "coil";
}

struct Kind {
  const char* name;
  double low;  // of the raw number; not finite: no bound
  double high;
};

Kind kind_of_values(const Register& reg) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  if (reg.table == Table::coil || reg.table == Table::discrete_input) return {"bool", 0.0, 1.0};
  switch (reg.type) {
    case RegisterType::u16: return {"u16", 0.0, 65535.0};
    case RegisterType::i16: return {"i16", -32768.0, 32767.0};
    case RegisterType::u32: return {"u32", 0.0, 4294967295.0};
    case RegisterType::i32: return {"i32", -2147483648.0, 2147483647.0};
    case RegisterType::f32:
    case RegisterType::f64: break;
  }
  return {"f32", kNone, kNone};
}

bool of_box(const Register& reg) { return reg.area == map::Area::box; }

nlohmann::json name_of(const Register& reg) {
  const Kind kind = kind_of_values(reg);
  return {{"name", reg.name},
          {"table", short_name(reg.table)},
          {"area", of_box(reg) ? "box" : "loop"},
          {"unit", reg.unit},
          {"type", kind.name},
          {"writable", map::writable(reg)},
          {"low", number(kind.low * reg.scale)},
          {"high", number(kind.high * reg.scale)},
          {"meaning", reg.meaning}};
}

// As a master would read it; null where the map's mark says that it is not there.
double as_read(const Register& reg, double value) {
  if (reg.type == RegisterType::f32 || !std::isfinite(value)) return value;
  const Kind kind = kind_of_values(reg);
  const double raw = std::clamp(std::round(value / reg.scale), kind.low, kind.high);
  const bool missing = reg.type == RegisterType::i16 && raw == map::kScaledInvalid;
  return missing ? std::numeric_limits<double>::quiet_NaN() : raw * reg.scale;
}

void put_values(std::string& text, gateway::MapValues& values, bool box, std::size_t loop) {
  text += '[';
  for (const Register& reg : map::registers()) {
    if (of_box(reg) != box) continue;
    put(text, as_read(reg, values.value(reg, loop)), kDigits);
    text += ',';
  }
  text.back() = ']';
}

}  // namespace

std::string registers(const Parts& parts, bool values_only) {
  PlantReadings plant(parts);
  const gateway::ServerState server = parts.modbus_server();
  gateway::MapValues values(plant, server);
  std::string text = R"({"ok":true,)";
  if (!values_only) {
    nlohmann::json names = nlohmann::json::array();
    for (const Register& reg : map::registers()) names.push_back(name_of(reg));
    text += "\"names\":" + names.dump() + ',';
  }
  // Not of the map, which has no process alarms.
  text += "\"alarm_changes\":" + std::to_string(parts.board.alarm_changes()) + ',';
  text += "\"box\":";
  put_values(text, values, true, 0);
  text += ",\"loops\":[";
  for (std::size_t i = 0; i < plant.loops(); ++i) {
    if (i > 0) text += ',';
    text += "{\"tag\":" + nlohmann::json(plant.name(i)).dump() + ",\"values\":";
    put_values(text, values, false, i);
    text += '}';
  }
  text += "]}";
  return text;
}

}  // namespace loopwarden::daemon::console
