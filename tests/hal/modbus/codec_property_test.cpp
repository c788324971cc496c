// SPDX-License-Identifier: Apache-2.0
// Rules that hold for every register type, byte order, scale and value.
#include <bit>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdint>
#include <limits>

#include "hal/modbus/register_codec.hpp"
#include "tests/support/property.hpp"

namespace codec_property_test {

using namespace loopwarden::hal::modbus;
using namespace loopwarden::tests::property;

namespace {

constexpr RegisterType kTypes[] = {RegisterType::u16, RegisterType::i16, RegisterType::u32,
                                   RegisterType::i32, RegisterType::f32, RegisterType::f64};
constexpr ByteOrder kOrders[] = {ByteOrder::abcd, ByteOrder::cdab, ByteOrder::badc,
                                 ByteOrder::dcba};

RegisterSpec any_spec() {
  RegisterSpec spec;
  spec.type = kTypes[one_of(std::size(kTypes))];
  spec.order = kOrders[one_of(std::size(kOrders))];
  return spec;
}

bool holds_fractions(RegisterType type) {
  return type == RegisterType::f32 || type == RegisterType::f64;
}

}  // namespace

TEST_CASE("registers are restored from the number that they decode to",
          "[modbus][codec][property]") {
  for_all("registers, number, registers", 3000, [] {
    const RegisterSpec spec = any_spec();
    Registers given;
    given.count = register_count(spec.type);
    for (std::size_t i = 0; i < given.count; ++i) {
      given.words[i] = static_cast<std::uint16_t>(bits());
    }
    const double value = decode(spec, given.view());
    Registers again;
    const EncodeResult result = encode(spec, value, again);
    if (std::isnan(value)) {  // the registers held NaN or infinity
      require(holds_fractions(spec.type), "only floating-point registers can hold no number");
      require(result == EncodeResult::refused && again.count == 0, "no number is not written");
      return;
    }
    require(result == EncodeResult::encoded, "what was read can be written");
    require(again.count == given.count && again.words == given.words, "the same registers");
  });
}

TEST_CASE("a value is rounded by at most half a step, and limited by the type",
          "[modbus][codec][property]") {
  for_all("number, registers, number", 3000, [] {
    RegisterSpec spec = any_spec();
    const double size = number(1e-6, 1e6);
    spec.scale = coin() ? size : -size;
    spec.offset = number(-1e4, 1e4);
    const double value = number(-1e9, 1e9);
    Registers registers;
    const EncodeResult result = encode(spec, value, registers);
    require(result != EncodeResult::refused, "a number is not refused");
    const double back = decode(spec, registers.view());
    require(back == representable(spec, value),
            "representable() returns the value that is read back");
    const double error = std::abs(back - value);
    // The error of the arithmetic with scale and offset.
    const double rounding =
        8.0 * std::numeric_limits<double>::epsilon() * (std::abs(value) + std::abs(spec.offset));
    const double step = spec.type == RegisterType::f64   ? 0.0
                        : spec.type == RegisterType::f32 ? 0x1p-23 * std::abs(value - spec.offset)
                                                         : 0.5 * std::abs(spec.scale);
    if (result == EncodeResult::encoded) {
      require(error <= step + rounding, "as near as the register can hold");
    } else {
      // At the end of the type's range, on the side of the value. Values further out decode the
      // same.
      Registers further;
      encode(spec, value + (value > back ? 1e9 : -1e9), further);
      require(further.words == registers.words, "a limit is the end");
      require(!holds_fractions(spec.type), "these values fit into floating point");
    }
  });
}

TEST_CASE("the byte order only moves bytes", "[modbus][codec][property]") {
  for_all("one value in four orders", 1000, [] {
    RegisterSpec spec;
    spec.type = kTypes[one_of(std::size(kTypes))];
    const double value = number(-40000.0, 70000.0);
    Registers straight;
    encode(spec, value, straight);
    const std::size_t n = straight.count;
    for (const ByteOrder order : kOrders) {
      spec.order = order;
      Registers moved;
      encode(spec, value, moved);
      require(decode(spec, moved.view()) == representable(spec, value), "reads back in its order");
      const bool words_turned = order == ByteOrder::cdab || order == ByteOrder::dcba;
      const bool bytes_turned = order == ByteOrder::badc || order == ByteOrder::dcba;
      for (std::size_t i = 0; i < n; ++i) {
        const unsigned word = straight.words[words_turned ? n - 1 - i : i];
        const unsigned turned = (word << 8U | word >> 8U) & 0xFFFFU;
        require(moved.words[i] == (bytes_turned ? turned : word), "the same bytes elsewhere");
      }
    }
  });
}

}  // namespace codec_property_test
