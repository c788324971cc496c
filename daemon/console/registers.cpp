// SPDX-License-Identifier: Apache-2.0
#include "daemon/console/registers.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "daemon/console/plant_readings.hpp"

namespace loopwarden::daemon::console {
namespace {

using hal::modbus::RegisterType;
using registers::Register;
using registers::Table;

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
  double low;  // limit of the raw number; NaN: no limit
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

bool of_box(const Register& reg) { return reg.area == registers::Area::box; }

protocol::Field field_of(const Register& reg) {
  const Kind kind = kind_of_values(reg);
  return {.name = reg.name,
          .table = short_name(reg.table),
          .area = of_box(reg) ? "box" : "loop",
          .unit = reg.unit,
          .type = kind.name,
          .writable = registers::writable(reg),
          .low = kind.low * reg.scale,
          .high = kind.high * reg.scale,
          .meaning = reg.meaning};
}

// Returns the value that a master reads; NaN if the register has the mark for a missing value.
double as_read(const Register& reg, double value) {
  if (reg.type == RegisterType::f32 || !std::isfinite(value)) return value;
  const Kind kind = kind_of_values(reg);
  const double raw = std::clamp(std::round(value / reg.scale), kind.low, kind.high);
  const bool missing = reg.type == RegisterType::i16 && raw == registers::kScaledInvalid;
  return missing ? std::numeric_limits<double>::quiet_NaN() : raw * reg.scale;
}

std::vector<double> values_of(gateway::MapValues& values, bool box, std::size_t loop) {
  std::vector<double> all;
  for (const Register& reg : registers::registers()) {
    if (of_box(reg) == box) all.push_back(as_read(reg, values.value(reg, loop)));
  }
  return all;
}

}  // namespace

protocol::Registers registers(const Plant& plant, const DaemonInfo& info,
                              const protocol::RegistersRequest& request) {
  PlantReadings readings(plant, info);
  const gateway::ServerState server = info.modbus_server();
  gateway::MapValues values(readings, server);
  protocol::Registers all;
  if (!request.values_only.value_or(false)) {
    std::vector<protocol::Field>& names = all.names.emplace();
    for (const Register& reg : registers::registers()) names.push_back(field_of(reg));
  }
  // Counts all alarms; the map has no process alarms.
  all.alarm_changes = plant.alarms.changes() + plant.box_alarms.changes();
  all.box = values_of(values, true, 0);
  for (std::size_t i = 0; i < readings.loops(); ++i) {
    all.loops.push_back({readings.name(i), values_of(values, false, i)});
  }
  return all;
}

}  // namespace loopwarden::daemon::console
