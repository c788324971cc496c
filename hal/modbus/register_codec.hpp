// SPDX-License-Identifier: Apache-2.0
// Converts numbers to registers and back. It does its own packing. The float helpers of libmodbus
// 3.1.6 don't return the stored value in any byte order (libmodbus issues 807 and 838).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "hal/modbus/modbus_settings.hpp"

namespace loopwarden::hal::modbus {

inline constexpr std::size_t kMaxValueRegisters = 4;

// The registers of one value in the order of their addresses.
struct Registers {
  std::array<std::uint16_t, kMaxValueRegisters> words{};
  std::size_t count = 0;
  std::span<const std::uint16_t> view() const noexcept { return {words.data(), count}; }
};

// Returns the engineering value of the registers; NaN if they hold NaN or infinity, or are too few.
// Registers in excess of the type's size are ignored.
double decode(const RegisterSpec& spec, std::span<const std::uint16_t> registers) noexcept;

enum class EncodeResult : std::uint8_t {
  encoded,    // rounded to the nearest value that the register can hold
  saturated,  // beyond what the type can hold: its limit was taken
  refused     // not a finite number: no registers
};
EncodeResult encode(const RegisterSpec& spec, double engineering, Registers& registers) noexcept;

// Returns the value that the device reads if `engineering` is written: rounded and limited by the
// register's type. Returns NaN if it is refused.
double representable(const RegisterSpec& spec, double engineering) noexcept;

}  // namespace loopwarden::hal::modbus
