// SPDX-License-Identifier: Apache-2.0
#include "services/net/sparkplug/payload.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/property.hpp"

namespace payload_test {

using namespace loopwarden::sparkplug;
namespace property = loopwarden::tests::property;

Metric metric(std::string name, DataType type, Value value) {
  Metric m;
  m.name = std::move(name);
  m.type = type;
  m.value = std::move(value);
  return m;
}

std::string hex(const std::string& bytes) {
  static const char* const digits = "0123456789abcdef";
  std::string text;
  for (const char c : bytes) {
    text += digits[static_cast<unsigned char>(c) >> 4U];
    text += digits[static_cast<unsigned char>(c) & 15U];
  }
  return text;
}

TEST_CASE("encoded bytes have the specification's field numbers", "[sparkplug]") {
  Payload payload{
      .time_ms = 1, .seq = 2, .metrics = {metric("a", DataType::int8, std::int64_t{-1})}};
  payload.metrics[0].alias = 3;
  payload.metrics[0].time_ms = 4;
  payload.metrics[0].historical = true;
  // timestamp 1:1, metrics 2:{name 1:"a", alias 2:3, timestamp 3:4, datatype 4:1, is_historical
  // 5:1, int_value
  // 10:0xFFFFFFFF}, seq 3:2
  CHECK(hex(encode(payload, Types::sent)) ==
        "0801"
        "1211"
        "0a0161"
        "1003"
        "1804"
        "2001"
        "2801"
        "50ffffffff0f"
        "1802");
  payload.metrics[0].name.clear();
  CHECK(hex(encode(payload, Types::left_out)) ==
        "0801"
        "120c"
        "1003"
        "1804"
        "2801"
        "50ffffffff0f"
        "1802");
}

TEST_CASE("every kind of value is read back unchanged", "[sparkplug]") {
  constexpr std::int64_t kLow64 = std::numeric_limits<std::int64_t>::min();
  constexpr std::uint64_t kHigh64 = std::numeric_limits<std::uint64_t>::max();
  Payload payload{
      .time_ms = 1'700'000'000'000,
      .seq = 255,
      .metrics = {metric("i8", DataType::int8, std::int64_t{-128}),
                  metric("i16", DataType::int16, std::int64_t{-32768}),
                  metric("i32", DataType::int32, std::int64_t{-2147483648LL}),
                  metric("i64", DataType::int64, kLow64),
                  metric("u8", DataType::uint8, std::uint64_t{255}),
                  metric("u16", DataType::uint16, std::uint64_t{65535}),
                  metric("u32", DataType::uint32, std::uint64_t{4294967295U}),
                  metric("u64", DataType::uint64, kHigh64), metric("f", DataType::float32, 0.5),
                  metric("d", DataType::float64, 0.1), metric("b", DataType::boolean, true),
                  metric("s", DataType::string, std::string("Öl, 20 °C")),
                  metric("t", DataType::date_time, std::uint64_t{1'700'000'000'000}),
                  metric("x", DataType::text, std::string()),
                  metric("y", DataType::bytes, Bytes{std::string("\0\xFF", 2)}),
                  metric("n", DataType::float64, {})}};
  payload.metrics[0].properties = {{"engLow", DataType::float64, -1.5},
                                   {"engUnit", DataType::string, std::string("m³/h")},
                                   {"Quality", DataType::int32, std::int64_t{192}}};
  Metric file = metric("file/a.csv", DataType::file, Bytes{"1,2"});
  file.metadata = MetaData{.multi_part = true,
                           .content_type = "text/csv",
                           .size = 3,
                           .part = 7,
                           .file_name = "a.csv",
                           .file_type = "csv",
                           .md5 = "00",
                           .description = "{}"};
  file.transient = true;
  payload.metrics.push_back(file);
  CHECK(decode(encode(payload, Types::sent)) == payload);
  CHECK(payload.find("f")->value == Value(0.5));
  CHECK(payload.find("none") == nullptr);
  CHECK(payload.metrics[0].property("engUnit")->value == Value(std::string("m³/h")));
  CHECK(payload.metrics[0].property("none") == nullptr);
}

TEST_CASE("integers in a message without types get the type of the birth", "[sparkplug]") {
  Payload payload{.time_ms = {},
                  .seq = 1,
                  .metrics = {metric("", DataType::int16, std::int64_t{-2}),
                              metric("", DataType::uint32, std::uint64_t{7}),
                              metric("", DataType::int64, std::int64_t{-2}),
                              metric("", DataType::float32, 2.5)}};
  const Payload read = decode(encode(payload, Types::left_out));
  REQUIRE(read.metrics.size() == 4);
  CHECK(read.metrics[0].type == DataType::unknown);
  CHECK(retyped(read.metrics[0].value, DataType::int16) == Value(std::int64_t{-2}));
  CHECK(retyped(read.metrics[1].value, DataType::uint32) == Value(std::uint64_t{7}));
  CHECK(retyped(read.metrics[2].value, DataType::int64) == Value(std::int64_t{-2}));
  CHECK(retyped(read.metrics[3].value, DataType::float32) == Value(2.5));
  // The birth states a text, and the value is an integer. Such a value is invalid.
  CHECK(retyped(Value(std::uint64_t{1}), DataType::string) == Value(Opaque{}));
}

TEST_CASE("writing a type that contradicts its value is an error of the caller", "[sparkplug]") {
  const auto encoded = [](DataType type, Value value) {
    Payload payload{.time_ms = {}, .seq = {}, .metrics = {metric("a", type, std::move(value))}};
    return encode(payload, Types::sent);
  };
  CHECK_THROWS_AS(encoded(DataType::int8, std::int64_t{128}), std::logic_error);
  CHECK_THROWS_AS(encoded(DataType::uint8, std::uint64_t{256}), std::logic_error);
  CHECK_THROWS_AS(encoded(DataType::uint8, std::int64_t{1}), std::logic_error);
  CHECK_THROWS_AS(encoded(DataType::float64, std::int64_t{1}), std::logic_error);
  CHECK_THROWS_AS(encoded(DataType::boolean, 1.0), std::logic_error);
  CHECK_THROWS_AS(encoded(DataType::string, true), std::logic_error);
  CHECK_THROWS_AS(encoded(DataType::string, Bytes{"a"}), std::logic_error);
  CHECK_THROWS_AS(encoded(DataType::bytes, std::string("a")), std::logic_error);
  CHECK_THROWS_AS(encoded(DataType::data_set, Opaque{}), std::logic_error);
}

TEST_CASE("an invalid payload is refused, and unsupported values are marked", "[sparkplug]") {
  CHECK(decode("") == Payload{});
  CHECK_THROWS_AS(decode("\x01"), BadPayload);
  CHECK_THROWS_AS(decode(std::string(kMostPayloadBytes + 1, '\0')), BadPayload);
  const auto one = [](const std::string& fields) {
    return decode("\x12" + std::string(1, static_cast<char>(fields.size())) + fields);
  };
  CHECK_THROWS_WITH(one("\x0a\x01\xff"), Catch::Contains("UTF-8"));          // a lone byte
  CHECK_THROWS_WITH(one("\x0a\x03\xed\xa0\x80"), Catch::Contains("UTF-8"));  // a surrogate
  CHECK_THROWS_WITH(one("\x0a\x02\xc0\xaf"), Catch::Contains("UTF-8"));      // an overlong form
  CHECK_THROWS_WITH(one("\x0a\x04\xf4\x90\x80\x80"), Catch::Contains("UTF-8"));
  CHECK_THROWS_WITH(one(std::string("\x0a\x01\x00", 3)), Catch::Contains("UTF-8"));
  CHECK_THROWS_WITH(one("\x20\x23"), Catch::Contains("no data type 35"));
  CHECK_THROWS_WITH(one("\x4a\x03\x0a\x01\x61"), Catch::Contains("1 keys and 0 values"));
  CHECK(one("\x20\x10\x8a\x01\x02\x08\x01").metrics[0].value == Value(Opaque{}));  // a data set
  CHECK(one("\x20\x0c\x50\x01").metrics[0].value ==
        Value(Opaque{}));  // a String that is an integer
  CHECK(one("\x20\x0b\x38\x01\x50\x01").metrics[0].value == Value{});  // null, with any other field
  std::string many;
  for (std::size_t i = 0; i <= kMostMetrics; ++i) many += std::string("\x12\x00", 2);
  CHECK_THROWS_WITH(decode(many), Catch::Contains("metrics"));
}

Value drawn_value(DataType type) {
  if (property::one_of(8) == 0) return {};
  if (type == DataType::boolean) return property::coin();
  if (type == DataType::float64) return property::number(-1e300, 1e300);
  if (type == DataType::float32)
    return static_cast<double>(static_cast<float>(property::number(-1e30, 1e30)));
  if (is_signed(type)) return retyped(Value(property::bits()), type);
  if (is_unsigned(type)) return retyped(Value(property::bits()), type);
  std::string text;
  for (std::size_t i = property::one_of(20); i > 0; --i) {
    text += static_cast<char>(property::integer(1, 127));
  }
  return text;
}

TEST_CASE("any payload is read back unchanged", "[sparkplug]") {
  property::for_all("decode(encode(payload)) == payload", 300, [] {
    Payload payload{.time_ms = property::bits(), .seq = property::bits(), .metrics = {}};
    for (std::size_t i = property::one_of(8); i > 0; --i) {
      const auto type = static_cast<DataType>(property::integer(1, 15));
      Metric m = metric("m" + std::to_string(i), type, drawn_value(type));
      if (property::coin()) m.alias = property::bits();
      if (property::coin()) m.time_ms = property::bits();
      m.historical = property::coin();
      payload.metrics.push_back(std::move(m));
    }
    property::require(decode(encode(payload, Types::sent)) == payload, "as it was");
  });
}

TEST_CASE("any bytes are read or refused, and a read payload can be written", "[sparkplug]") {
  property::for_all("decode", 2000, [] {
    std::string bytes;
    for (std::size_t i = property::one_of(60); i > 0; --i) {
      bytes += static_cast<char>(property::integer(0, 255));
    }
    try {
      const Payload payload = decode(bytes);
      for (const Metric& m : payload.metrics)
        property::require(m.name.find('\0') == std::string::npos, "text");
    } catch (const BadPayload&) {
    }
  });
}

TEST_CASE("types have the specification's names", "[sparkplug]") {
  CHECK(std::string(to_text(DataType::unknown)) == "Unknown");
  CHECK(std::string(to_text(DataType::float32)) == "Float");
  CHECK(std::string(to_text(DataType::file)) == "File");
  CHECK(std::string(to_text(DataType::int8_array)) == "Int8Array");
  CHECK(std::string(to_text(DataType::date_time_array)) == "DateTimeArray");
}

}  // namespace payload_test
