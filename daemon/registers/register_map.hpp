// SPDX-License-Identifier: Apache-2.0
// The Modbus registers that the daemon serves, in one table. The server answers from this table.
// Documents and snippets are generated from it (`loopwarden register-map`). No other source
// contains an address.
//
// Each of the four tables has one block for the box, followed by one block per loop in the order of
// the loops' files. All blocks of loops have the same layout. Input registers have a second, short
// block per loop, after the space for all first blocks, because the first blocks are full. Holding
// registers and coils have a third block per loop. These blocks start in the middle of the address
// range. Registers of the third block are read-only unless writable() returns true. Addresses are
// those on the wire, from 0. A field of type f32 or u32 takes two registers. Addresses between the
// fields of a block are reserved and read 0.
//
// Compatibility: a field keeps its address and meaning until the major version changes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "hal/modbus/modbus_settings.hpp"

namespace loopwarden::registers {

inline constexpr std::uint16_t kMagic = 0x4C50;
inline constexpr std::uint16_t kVersion = 0x0106;  // major, minor
inline constexpr float kFloatTest = 123456.0F;     // 0x47F1 0x2000 in order abcd
inline constexpr std::uint32_t kIntegerTest = 0x01020304;
// reading of a scaled copy whose value is unknown
inline constexpr std::int16_t kScaledInvalid = -32768;

enum class Table : std::uint8_t { input_register, holding_register, discrete_input, coil };
inline constexpr std::size_t kTables = 4;
inline constexpr std::size_t kAreas = 4;
// box: block of the host; loop, condition, third: the first, second and third block of a loop
enum class Area : std::uint8_t { box, loop, condition, third };

const char* to_text(Table table) noexcept;

// Start and size of the blocks of a table.
struct Layout {
  std::uint16_t box_size;              // block of the box, which starts at 0
  std::uint16_t first_loop;            // start of the first loop's block
  std::uint16_t loop_stride;           // size of a loop's block, and distance to the next one
  std::uint16_t first_condition = 0;   // start of the first loop's second block; 0: no such block
  std::uint16_t condition_stride = 0;  // size of a second block, and distance to the next one
  std::uint16_t first_third = 0;       // start of the first loop's third block; 0: no such block
  std::uint16_t third_stride = 0;      // size of a third block, and distance to the next one
};
constexpr Layout layout(Table table) noexcept {
  switch (table) {
    case Table::input_register: return {64, 64, 64, 0xE000, 8};
    case Table::holding_register: return {32, 32, 32, 0, 0, 0x8000, 32};
    case Table::discrete_input: return {32, 32, 32};
    case Table::coil: break;
  }
  return {16, 16, 16, 0, 0, 0x8000, 4};
}
// The input registers limit the number of loops: their first blocks must end before the second
// blocks.
inline constexpr std::size_t kMostLoops = (0xE000 - 64) / 64;

// The fields of the map. A field that exists once per alarm has the number of a alarm::AlarmKind.
// A field that exists once per condition index has a number in the order of
// analysis::ConditionIndices, from control performance to environment.
enum class Field : std::uint8_t {
  // box, input registers
  magic,
  map_version,
  heartbeat,
  status_bits,
  uptime,
  loop_count,
  first_block,
  block_stride,
  box_ne107,
  overruns,
  wake_up_worst,
  wake_up_p99,
  float_test,
  integer_test,
  config_hash,
  model_hash,
  utc_seconds,
  utc_milliseconds,
  word_order,
  alarms_active,
  alarms_unacknowledged,
  alarms_shelved,
  windows_judged,
  window_backlog,
  monitor_dropped,
  journal_waiting,
  journal_lost,
  clients,
  first_condition,
  condition_stride,
  first_third,
  third_stride,
  box_alarms,
  // loop, input registers
  sequence_head,
  mode,
  requested_mode,
  pv_quality,
  pv_reason,
  fault,
  sp,
  pv,
  co,
  stem,
  jacket_rate,
  sp_scaled,
  pv_scaled,
  co_scaled,
  stem_scaled,
  pv_age,
  ne107,
  loop_bits,
  variability,
  mean_error,
  oscillation_index,
  oscillation_period,
  travel,
  reversals,
  stick,
  stick_source,
  saturated,
  window_state,
  window_number,
  window_severity,
  probability,
  alarm_severity,
  alarm_state,
  hours_automatic,
  hours_manual,
  hours_at_limit,
  records_dropped,
  corrective_action,
  sequence_tail,
  condition,
  // discrete inputs
  running,
  any_alarm_active,
  any_alarm_unacknowledged,
  writes_enabled,
  any_simulated,
  master_lost,
  journal_trouble,
  no_real_time_rights,
  alarm_active,
  alarm_unacknowledged,
  pv_bad,
  at_low,
  at_high,
  in_manual,
  any_suppressed,
  any_shelved,
  communication_lost,
  in_fault,
  window_valid,
  // holding registers
  master_heartbeat,
  wanted_mode,
  wanted_sp,
  wanted_output,
  kp,
  ki,
  kd,
  wanted_sp_scaled,
  wanted_output_scaled,
  shelve_minutes,
  explanation_effect,
  explanation_agrees,
  explanation_size,
  explanation_low,
  explanation_high,
  explanation_gap_closed,
  explanation_alarm,
  explanation_age,
  moves_phase,
  moves_gain,
  unshelve_process,
  process_active,
  process_unacknowledged,
  process_shelved,
  process_suppressed,
  jacket_rate_shadow,
  compensator,
  compensator_shadow,
  orders_refused,
  // coils
  acknowledge_all,
  acknowledge,
  acknowledge_process,
  reset,
  unshelve,
  veto_corrective_action,
  calm
};

struct Register {
  Field field;
  // number of the alarm or index, for fields that exist once for each; otherwise 0
  std::uint8_t which;
  Table table;
  Area area;
  std::uint16_t offset;  // from the start of the block
  hal::modbus::RegisterType type;
  double scale;      // value = raw * scale
  const char* name;  // unique within table and area
  const char* unit;  // "PV", "CO": the loop's units; empty: a pure number
  const char* meaning;
};

// Returns all registers, sorted by table, area and offset.
std::span<const Register> registers() noexcept;

// Returns the number of addresses that a register takes: 2 for f32 and u32, otherwise 1.
std::uint16_t width(const Register& reg) noexcept;

// Returns whether a listed master can write the register.
constexpr bool writable(const Register& reg) noexcept {
  if (reg.area == Area::third) {
    return reg.table == Table::coil || reg.field == Field::shelve_minutes ||
           reg.field == Field::unshelve_process || reg.field == Field::calm;
  }
  if (reg.field == Field::moves_phase || reg.field == Field::moves_gain) return false;
  return reg.table == Table::holding_register || reg.table == Table::coil;
}

// A place in the third block that is reserved for a planned field. No other field may use it. It
// reads 0.
struct Reserved {
  Table table;
  std::uint16_t offset;
  std::uint16_t words;
  const char* meaning;
};
std::span<const Reserved> reserved() noexcept;

// Returns the address of a register in the block of `loop`. For a register of the box, `loop` is
// ignored.
constexpr std::uint32_t address(const Register& reg, std::size_t loop) noexcept {
  const Layout l = layout(reg.table);
  switch (reg.area) {
    case Area::loop:
      return static_cast<std::uint32_t>(l.first_loop + loop * l.loop_stride + reg.offset);
    case Area::condition:
      return static_cast<std::uint32_t>(l.first_condition + loop * l.condition_stride + reg.offset);
    case Area::third:
      return static_cast<std::uint32_t>(l.first_third + loop * l.third_stride + reg.offset);
    case Area::box: break;
  }
  return reg.offset;
}

// The block and register at an address.
struct Place {
  bool in_map = false;
  std::size_t loop = 0;           // if the address is in a block of a loop
  const Register* reg = nullptr;  // null: reserved
  std::uint16_t word = 0;         // address within the register: 0 or 1
};
Place find(Table table, std::uint32_t address, std::size_t loops) noexcept;

}  // namespace loopwarden::registers
