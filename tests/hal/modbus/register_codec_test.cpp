// SPDX-License-Identifier: Apache-2.0
#include "hal/modbus/register_codec.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace register_codec_test {

using namespace loopwarden::hal::modbus;

namespace {

using Words = std::vector<std::uint16_t>;

RegisterSpec spec(RegisterType type, ByteOrder order = ByteOrder::abcd, double scale = 1.0,
                  double offset = 0.0) {
  RegisterSpec result;
  result.type = type;
  result.order = order;
  result.scale = scale;
  result.offset = offset;
  return result;
}

Words encoded(const RegisterSpec& of, double value) {
  Registers registers;
  encode(of, value, registers);
  return {registers.view().begin(), registers.view().end()};
}

constexpr ByteOrder kOrders[] = {ByteOrder::abcd, ByteOrder::cdab, ByteOrder::badc,
                                 ByteOrder::dcba};
constexpr double kInfinity = std::numeric_limits<double>::infinity();
const double kNaN = std::numeric_limits<double>::quiet_NaN();

}  // namespace

TEST_CASE("registers hold the bytes in the configured order", "[modbus][codec]") {
  struct Case {
    RegisterType type;
    ByteOrder order;
    double value;
    Words words;
  };
  // 123456.0f is 47F12000h, 305419896 is 12345678h, 1.5 is 3FF8000000000000h;
  // 1.2345 as f64 is 3FF3C083126E978Dh.
  const Case cases[] = {
      {RegisterType::u16, ByteOrder::abcd, 0x1234, {0x1234}},
      {RegisterType::u16, ByteOrder::cdab, 0x1234, {0x1234}},
      {RegisterType::u16, ByteOrder::badc, 0x1234, {0x3412}},
      {RegisterType::u16, ByteOrder::dcba, 0x1234, {0x3412}},
      {RegisterType::i16, ByteOrder::abcd, -2, {0xFFFE}},
      {RegisterType::u32, ByteOrder::abcd, 0x12345678, {0x1234, 0x5678}},
      {RegisterType::u32, ByteOrder::cdab, 0x12345678, {0x5678, 0x1234}},
      {RegisterType::u32, ByteOrder::badc, 0x12345678, {0x3412, 0x7856}},
      {RegisterType::u32, ByteOrder::dcba, 0x12345678, {0x7856, 0x3412}},
      {RegisterType::i32, ByteOrder::abcd, -2, {0xFFFF, 0xFFFE}},
      {RegisterType::i32, ByteOrder::cdab, -65536, {0x0000, 0xFFFF}},
      {RegisterType::f32, ByteOrder::abcd, 123456.0, {0x47F1, 0x2000}},
      {RegisterType::f32, ByteOrder::cdab, 123456.0, {0x2000, 0x47F1}},
      {RegisterType::f32, ByteOrder::badc, 123456.0, {0xF147, 0x0020}},
      {RegisterType::f32, ByteOrder::dcba, 123456.0, {0x0020, 0xF147}},
      {RegisterType::f64, ByteOrder::abcd, 1.2345, {0x3FF3, 0xC083, 0x126E, 0x978D}},
      {RegisterType::f64, ByteOrder::cdab, 1.2345, {0x978D, 0x126E, 0xC083, 0x3FF3}},
      {RegisterType::f64, ByteOrder::badc, 1.2345, {0xF33F, 0x83C0, 0x6E12, 0x8D97}},
      {RegisterType::f64, ByteOrder::dcba, 1.2345, {0x8D97, 0x6E12, 0x83C0, 0xF33F}},
  };
  for (const Case& c : cases) {
    const RegisterSpec of = spec(c.type, c.order);
    CAPTURE(static_cast<int>(c.type), static_cast<int>(c.order), c.value);
    CHECK(encoded(of, c.value) == c.words);
    CHECK(decode(of, c.words) == c.value);
    CHECK(c.words.size() == register_count(c.type));
  }
}

TEST_CASE("a value is decoded as it was encoded", "[modbus][codec]") {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> any(-30000.0, 30000.0);
  for (const ByteOrder order : kOrders) {
    for (int i = 0; i < 200; ++i) {
      const double value = any(random);
      CHECK(representable(spec(RegisterType::f64, order), value) == value);
      CHECK(representable(spec(RegisterType::f32, order), value) ==
            static_cast<double>(static_cast<float>(value)));
      CHECK(representable(spec(RegisterType::i32, order), value) == std::round(value));
      CHECK(representable(spec(RegisterType::i16, order), value) == std::round(value));
      CHECK(representable(spec(RegisterType::u32, order), std::abs(value)) ==
            std::round(std::abs(value)));
    }
  }
}

TEST_CASE("scale and offset turn raw numbers into engineering units", "[modbus][codec]") {
  // 4..20 mA as 0..27648, the range of a common analogue input card: 0..10 V.
  const RegisterSpec card = spec(RegisterType::i16, ByteOrder::abcd, 10.0 / 27648.0, 0.0);
  CHECK(decode(card, Words{27648}) == Approx(10.0));
  CHECK(encoded(card, 5.0) == Words{13824});

  const RegisterSpec shifted = spec(RegisterType::u16, ByteOrder::abcd, 0.1, -20.0);
  CHECK(decode(shifted, Words{450}) == Approx(25.0));
  CHECK(encoded(shifted, 25.04) == Words{450});
  CHECK(representable(shifted, 25.04) == Approx(25.0));

  const RegisterSpec reversed = spec(RegisterType::u16, ByteOrder::abcd, -0.01, 100.0);
  CHECK(decode(reversed, Words{2500}) == Approx(75.0));
  CHECK(encoded(reversed, 75.0) == Words{2500});
}

TEST_CASE("a value outside the type becomes its limit, and this is reported", "[modbus][codec]") {
  struct Case {
    RegisterType type;
    double value;
    double held;
  };
  const Case cases[] = {
      {RegisterType::u16, -1.0, 0.0},
      {RegisterType::u16, 65536.0, 65535.0},
      {RegisterType::i16, 40000.0, 32767.0},
      {RegisterType::i16, -40000.0, -32768.0},
      {RegisterType::u32, -5.0, 0.0},
      {RegisterType::u32, 1e12, 4294967295.0},
      {RegisterType::i32, 1e12, 2147483647.0},
      {RegisterType::i32, -1e12, -2147483648.0},
      {RegisterType::f32, 1e300, static_cast<double>(std::numeric_limits<float>::max())},
      {RegisterType::f32, -1e300, static_cast<double>(std::numeric_limits<float>::lowest())},
  };
  for (const Case& c : cases) {
    CAPTURE(static_cast<int>(c.type), c.value);
    Registers registers;
    CHECK(encode(spec(c.type), c.value, registers) == EncodeResult::saturated);
    CHECK(decode(spec(c.type), registers.view()) == c.held);
    CHECK(encode(spec(c.type), c.held, registers) == EncodeResult::encoded);
  }
}

TEST_CASE("a value that is no number is refused", "[modbus][codec]") {
  for (const double value : {kNaN, kInfinity, -kInfinity}) {
    for (const RegisterType type :
         {RegisterType::u16, RegisterType::i32, RegisterType::f32, RegisterType::f64}) {
      Registers registers;
      registers.count = 4;
      CHECK(encode(spec(type), value, registers) == EncodeResult::refused);
      CHECK(registers.count == 0);
      CHECK(std::isnan(representable(spec(type), value)));
    }
  }
}

TEST_CASE("registers that hold no number decode to NaN", "[modbus][codec]") {
  CHECK(std::isnan(decode(spec(RegisterType::f32), Words{0x7FC0, 0x0000})));
  CHECK(std::isnan(decode(spec(RegisterType::f32), Words{0x7F80, 0x0000})));
  CHECK(std::isnan(decode(spec(RegisterType::f32), Words{0x47F1})));
  CHECK(std::isnan(decode(spec(RegisterType::f64), Words{0x7FF0, 0, 0})));
  CHECK(
      std::isnan(decode(spec(RegisterType::f64, ByteOrder::abcd, 1e300), Words{0x7FE0, 0, 0, 0})));
}

}  // namespace register_codec_test
