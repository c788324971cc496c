// SPDX-License-Identifier: Apache-2.0
#include "hal/modbus/register_codec.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace loopwarden::hal::modbus {
namespace {

constexpr bool words_reversed(ByteOrder order) noexcept {
  return order == ByteOrder::cdab || order == ByteOrder::dcba;
}

constexpr bool bytes_swapped(ByteOrder order) noexcept {
  return order == ByteOrder::badc || order == ByteOrder::dcba;
}

constexpr std::uint16_t swap_bytes(std::uint16_t word) noexcept {
  return static_cast<std::uint16_t>((word << 8) | (word >> 8));
}

// Returns `count` registers as one unsigned number. In order abcd the first word is most
// significant.
std::uint64_t assemble(const std::uint16_t* words, std::size_t count, ByteOrder order) noexcept {
  std::uint64_t bits = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint16_t word = words[words_reversed(order) ? count - 1 - i : i];
    bits = (bits << 16) | (bytes_swapped(order) ? swap_bytes(word) : word);
  }
  return bits;
}

void spread(std::uint64_t bits, ByteOrder order, Registers& registers) noexcept {
  for (std::size_t i = 0; i < registers.count; ++i) {
    const auto word = static_cast<std::uint16_t>(bits >> (16 * (registers.count - 1 - i)));
    registers.words[words_reversed(order) ? registers.count - 1 - i : i] =
        bytes_swapped(order) ? swap_bytes(word) : word;
  }
}

// Returns the nearest number that T can hold.
template <class T>
T to_integer(double value, bool& saturated) noexcept {
  constexpr double low = std::numeric_limits<T>::min();
  constexpr double high = std::numeric_limits<T>::max();
  const double rounded = std::round(value);
  saturated = rounded < low || rounded > high;
  return static_cast<T>(std::clamp(rounded, low, high));
}

double raw_value(RegisterType type, std::uint64_t bits) noexcept {
  switch (type) {
    case RegisterType::u16: return static_cast<double>(static_cast<std::uint16_t>(bits));
    case RegisterType::i16: return static_cast<double>(static_cast<std::int16_t>(bits));
    case RegisterType::u32: return static_cast<double>(static_cast<std::uint32_t>(bits));
    case RegisterType::i32: return static_cast<double>(static_cast<std::int32_t>(bits));
    case RegisterType::f32:
      return static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(bits)));
    case RegisterType::f64: break;
  }
  return std::bit_cast<double>(bits);
}

std::uint64_t raw_bits(RegisterType type, double raw, bool& saturated) noexcept {
  switch (type) {
    case RegisterType::u16: return to_integer<std::uint16_t>(raw, saturated);
    case RegisterType::i16:
      return static_cast<std::uint16_t>(to_integer<std::int16_t>(raw, saturated));
    case RegisterType::u32: return to_integer<std::uint32_t>(raw, saturated);
    case RegisterType::i32:
      return static_cast<std::uint32_t>(to_integer<std::int32_t>(raw, saturated));
    case RegisterType::f32: {
      constexpr double limit = static_cast<double>(std::numeric_limits<float>::max());
      saturated = std::abs(raw) > limit;
      return std::bit_cast<std::uint32_t>(static_cast<float>(std::clamp(raw, -limit, limit)));
    }
    case RegisterType::f64: break;
  }
  saturated = false;
  return std::bit_cast<std::uint64_t>(raw);
}

}  // namespace

double decode(const RegisterSpec& spec, std::span<const std::uint16_t> registers) noexcept {
  const std::size_t count = register_count(spec.type);
  if (registers.size() < count) return std::numeric_limits<double>::quiet_NaN();
  const double raw = raw_value(spec.type, assemble(registers.data(), count, spec.order));
  const double value = raw * spec.scale + spec.offset;
  return std::isfinite(value) ? value : std::numeric_limits<double>::quiet_NaN();
}

EncodeResult encode(const RegisterSpec& spec, double engineering, Registers& registers) noexcept {
  registers = {};
  const double raw = (engineering - spec.offset) / spec.scale;
  if (!std::isfinite(raw)) return EncodeResult::refused;
  bool saturated = false;
  const std::uint64_t bits = raw_bits(spec.type, raw, saturated);
  registers.count = register_count(spec.type);
  spread(bits, spec.order, registers);
  return saturated ? EncodeResult::saturated : EncodeResult::encoded;
}

double representable(const RegisterSpec& spec, double engineering) noexcept {
  Registers registers;
  encode(spec, engineering, registers);
  return decode(spec, registers.view());
}

}  // namespace loopwarden::hal::modbus
