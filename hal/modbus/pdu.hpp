// SPDX-License-Identifier: Apache-2.0
// Encodes requests and checks that a reply answers exactly its request. libmodbus does not check
// the unit on TCP, nor the echoed value of function 6.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "hal/modbus/modbus_settings.hpp"

namespace loopwarden::hal::modbus {

inline constexpr std::size_t kMaxReadRegisters = 125;
// Registers that a read may have in addition, to give its reply a distinct length. For bits:
// additional bytes.
inline constexpr std::uint16_t kMostExtra = 8;
inline constexpr std::size_t kMaxRequestBytes = 16;
inline constexpr std::uint8_t kExceptionFlag = 0x80;  // in the function of an answer

// The functions that a read-only request can have.
enum class ReadFunction : std::uint8_t {
  coils = 1,
  discrete_inputs = 2,
  holding_registers = 3,
  input_registers = 4
};

constexpr ReadFunction read_function(Table table) noexcept {
  switch (table) {
    case Table::coil: return ReadFunction::coils;
    case Table::discrete_input: return ReadFunction::discrete_inputs;
    case Table::input_register: return ReadFunction::input_registers;
    case Table::holding_register: break;
  }
  return ReadFunction::holding_registers;
}

constexpr bool reads_bits(ReadFunction function) noexcept {
  return function == ReadFunction::coils || function == ReadFunction::discrete_inputs;
}

// Returns the number of value bytes in the reply to a read.
constexpr std::size_t reply_bytes(ReadFunction function, std::uint16_t count) noexcept {
  return reads_bits(function) ? (count + 7U) / 8U : 2U * count;
}

// One request: unit, then the protocol data unit.
struct Request {
  std::uint8_t unit = 0;
  std::uint8_t function = 0;
  std::optional<ReadFunction> read{};  // not set: it writes
  std::uint16_t address = 0;
  std::uint16_t count = 0;                             // registers or bits read or written
  std::array<std::uint8_t, kMaxRequestBytes> bytes{};  // starting with the unit
  std::size_t size = 0;

  std::span<const std::uint8_t> view() const noexcept { return {bytes.data(), size}; }
};

// count: 1..kMaxReadRegisters, bits as well.
Request read_request(std::uint8_t unit, ReadFunction function, std::uint16_t address,
                     std::uint16_t count) noexcept;
// values: 1 to 4 registers; function 6 takes the first.
Request write_request(std::uint8_t unit, WriteFunction function, std::uint16_t address,
                      std::span<const std::uint16_t> values) noexcept;

struct Reply {
  std::array<std::uint16_t, kMaxReadRegisters> registers{};  // of bits: 0 or 1 each
  std::size_t count = 0;
  std::uint8_t exception = 0;  // Modbus exception code

  std::span<const std::uint16_t> view() const noexcept { return {registers.data(), count}; }
};

enum class ReplyCheck : std::uint8_t { valid, exception, mismatch };

// `bytes` starts with the unit and ends with the protocol data unit. The reply is filled only if it
// is exactly one complete answer to this request. Unit, function, length and, for a write, the
// written values must match.
ReplyCheck check_reply(const Request& request, std::span<const std::uint8_t> bytes,
                       Reply& reply) noexcept;

// Returns whether a device with this exception may soon answer the same request with a value.
// Examples: it is busy (5, 6), a gateway has no path or no reply (0x0A, 0x0B), or the code is not a
// standard one. Illegal functions, addresses and values (1 to 3) and failures of the device (4, 7,
// 8) are permanent.
bool is_transient(std::uint8_t exception) noexcept;

// Returns a sentence for an engineer, without the unit.
std::string exception_text(std::uint8_t exception);
// "reading input registers 0 to 1 (function 4)"
std::string request_text(const Request& request);
// Returns advice if the device does not accept the function of this write; empty for a read.
std::string write_function_hint(const Request& request);
// Returns why check_reply() finds a mismatch. `bytes` as there.
std::string mismatch_text(const Request& request, std::span<const std::uint8_t> bytes);

}  // namespace loopwarden::hal::modbus
