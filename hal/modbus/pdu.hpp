// SPDX-License-Identifier: Apache-2.0
// Requests as bytes, and the check that a reply answers exactly this request. libmodbus leaves gaps
// here: on TCP it ignores the unit, and for function 6 it ignores what the device echoes.
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
// Registers that a read may have more than it needs, so that its length tells it from others; of bits: so many bytes.
inline constexpr std::uint16_t kMostExtra = 8;
inline constexpr std::size_t kMaxRequestBytes = 16;
inline constexpr std::uint8_t kExceptionFlag = 0x80;  // in the function of an answer

// Of a request that only reads there are no others.
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

// Bytes of values in the reply to a read.
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
// is the one and only complete answer to this request: unit, function, length, and for a write what
// was written.
ReplyCheck check_reply(const Request& request, std::span<const std::uint8_t> bytes,
                       Reply& reply) noexcept;

// Returns whether a device that answers with this exception may answer the same request with a
// value soon: it is busy (5, 6), a gateway has no path or no reply (0x0A, 0x0B), or the code is no
// standard one. Illegal functions, addresses and values (1 to 3) and failures of the device (4, 7,
// 8) last.
bool is_transient(std::uint8_t exception) noexcept;

// Sentences for an engineer, without the unit.
std::string exception_text(std::uint8_t exception);
// "reading input registers 0 to 1 (function 4)"
std::string request_text(const Request& request);
// What to change if the device does not take the function of this write; empty for a read.
std::string write_function_hint(const Request& request);
// Why check_reply() finds a mismatch. `bytes` as there.
std::string mismatch_text(const Request& request, std::span<const std::uint8_t> bytes);

}  // namespace loopwarden::hal::modbus
