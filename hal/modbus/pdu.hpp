// SPDX-License-Identifier: Apache-2.0
// Requests as bytes, and the check that a reply answers exactly this request. libmodbus leaves gaps
// here: on TCP it ignores the unit, and for function 6 it ignores what the device echoes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "hal/modbus/modbus_settings.hpp"

namespace loopwarden::hal::modbus {

inline constexpr std::size_t kMaxReadRegisters = 64;
inline constexpr std::size_t kMaxRequestBytes = 16;

enum class Function : std::uint8_t {
  read_holding_registers = 3,
  read_input_registers = 4,
  write_single_register = 6,
  write_multiple_registers = 16
};

constexpr Function read_function(Table table) noexcept {
  return table == Table::input_register ? Function::read_input_registers
                                        : Function::read_holding_registers;
}

// One request: unit, then the protocol data unit.
struct Request {
  std::uint8_t unit = 0;
  Function function = Function::read_holding_registers;
  std::uint16_t address = 0;
  std::uint16_t count = 0;                             // registers read or written
  std::array<std::uint8_t, kMaxRequestBytes> bytes{};  // starting with the unit
  std::size_t size = 0;

  std::span<const std::uint8_t> view() const noexcept { return {bytes.data(), size}; }
};

// count: 1..kMaxReadRegisters.
Request read_request(std::uint8_t unit, Function function, std::uint16_t address,
                     std::uint16_t count) noexcept;
// values: 1 to 4 registers; function 6 takes the first.
Request write_request(std::uint8_t unit, WriteFunction function, std::uint16_t address,
                      std::span<const std::uint16_t> values) noexcept;

struct Reply {
  std::array<std::uint16_t, kMaxReadRegisters> registers{};
  std::size_t count = 0;
  std::uint8_t exception = 0;  // Modbus exception code

  std::span<const std::uint16_t> view() const noexcept { return {registers.data(), count}; }
};

enum class ReplyCheck : std::uint8_t { valid, exception, mismatch };

// `bytes` starts with the unit and ends with the protocol data unit. The reply is filled only if it
// is the one and only complete answer to this request: unit, function, length, and for a write what
// was written.
ReplyCheck check_reply(const Request& request, std::span<const std::uint8_t> bytes,
                       Reply& reply) noexcept;

}  // namespace loopwarden::hal::modbus
