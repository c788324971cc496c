// SPDX-License-Identifier: Apache-2.0
// The Modbus registers that the daemon serves: one table, from which the server answers and from which
// every document and snippet is made (`loopwarden register-map`). Nothing else knows an address.
//
// Each of the four tables has one block for the box and, behind it, one of the same layout for each loop,
// in the order of the loops' files. The input registers have a short second block of each loop behind the
// room for all first ones, which are full. Holding registers and coils have a third block of each loop, from
// the middle of their addresses on; its registers are read-only where not said otherwise. Addresses are those on the wire, from 0. A field of an f32 or
// u32 takes two registers. What lies between the fields of a block is reserved: it reads 0.
//
// The map is a promise: a field keeps its place and meaning for as long as the major version stays.
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
inline constexpr std::int16_t kScaledInvalid = -32768;  // a scaled copy of what is not there

enum class Table : std::uint8_t { input_register, holding_register, discrete_input, coil };
inline constexpr std::size_t kTables = 4;
inline constexpr std::size_t kAreas = 4;
// condition: the second block of a loop
enum class Area : std::uint8_t { box, loop, condition, third };

const char* to_text(Table table) noexcept;

// Where the blocks of a table lie.
struct Layout {
  std::uint16_t box_size;              // the box's block begins at 0
  std::uint16_t first_loop;            // where the first loop's block begins
  std::uint16_t loop_stride;           // also the size of a loop's block
  std::uint16_t first_condition = 0;   // where the first loop's second block begins; 0: none
  std::uint16_t condition_stride = 0;  // also the size of it
  std::uint16_t first_third = 0;       // where the first loop's third block begins; 0: none
  std::uint16_t third_stride = 0;      // also the size of it
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
// The input registers are the first to run out of addresses, at the second blocks.
inline constexpr std::size_t kMostLoops = (0xE000 - 64) / 64;

// Alarms are counted as alarm::AlarmKind, condition indices from control performance to environment as in
// analysis::ConditionIndices; fields that stand once for each carry its number.
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
  std::uint8_t which;  // of a field that stands once for each alarm or index: its number, else 0
  Table table;
  Area area;
  std::uint16_t offset;  // from the start of the block
  hal::modbus::RegisterType type;
  double scale;      // value = raw * scale
  const char* name;  // unique within table and area
  const char* unit;  // "PV", "CO": the loop's units; empty: a pure number
  const char* meaning;
};

// All of them, by table, area and offset.
std::span<const Register> registers() noexcept;

// Addresses that a register takes: 1, or 2 of an f32 or u32.
std::uint16_t width(const Register& reg) noexcept;

// Whether masters on the list may write it at all.
constexpr bool writable(const Register& reg) noexcept {
  if (reg.area == Area::third) {
    return reg.table == Table::coil || reg.field == Field::shelve_minutes ||
           reg.field == Field::unshelve_process || reg.field == Field::calm;
  }
  if (reg.field == Field::moves_phase || reg.field == Field::moves_gain) return false;
  return reg.table == Table::holding_register || reg.table == Table::coil;
}

// Places of the third block that are kept for what comes: nothing else is ever put there, and until then
// they read 0.
struct Reserved {
  Table table;
  std::uint16_t offset;
  std::uint16_t words;
  const char* meaning;
};
std::span<const Reserved> reserved() noexcept;

// Where a register lies for a loop; `loop` is of no account for the box's.
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

// What lies at an address.
struct Place {
  bool in_map = false;
  std::size_t loop = 0;           // of a loop's block
  const Register* reg = nullptr;  // null: reserved
  std::uint16_t word = 0;         // which of the register's addresses
};
Place find(Table table, std::uint32_t address, std::size_t loops) noexcept;

}  // namespace loopwarden::registers
