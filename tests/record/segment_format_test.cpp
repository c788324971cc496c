// SPDX-License-Identifier: Apache-2.0
#include "record/segment_format.hpp"

#include <catch2/catch.hpp>
#include <cstddef>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

namespace segment_format_test {

using namespace loopwarden::record;

namespace {

SegmentHeader some_header() {
  return {.sequence = 42,
          .run = 40,
          .loop = "FIC-101",
          .period_s = 0.1,
          .start_utc_ns = 1'700'000'000'000'000'000,
          .start_monotonic_ns = 5'000'000'000};
}

}  // namespace

TEST_CASE("a header reads back") {
  const DecodedHeader decoded = decode_header(encode(some_header()).bytes);
  REQUIRE(decoded.problem == nullptr);
  CHECK(decoded.crc == encode(some_header()).crc);
  CHECK(decoded.header.sequence == 42);
  CHECK(decoded.header.run == 40);
  CHECK(decoded.header.loop == "FIC-101");
  CHECK(decoded.header.period_s == 0.1);
  CHECK(decoded.header.start_utc_ns == 1'700'000'000'000'000'000);
  CHECK(decoded.header.start_monotonic_ns == 5'000'000'000);
}

TEST_CASE("a loop's name is kept to 63 bytes") {
  SegmentHeader header = some_header();
  header.loop = std::string(100, 'x');
  CHECK(decode_header(encode(header).bytes).header.loop == std::string(63, 'x'));
}

TEST_CASE("a header with any byte changed is refused") {
  const EncodedHeader sound = encode(some_header());
  for (std::size_t i = 0; i < sound.bytes.size(); ++i) {
    EncodedHeader damaged = sound;
    damaged.bytes[i] = static_cast<char>(damaged.bytes[i] ^ 0x10);
    INFO(i);
    CHECK(decode_header(damaged.bytes).problem != nullptr);
  }
  CHECK(decode_header(std::span(sound.bytes).first(511)).problem != nullptr);
}

TEST_CASE("an impossible period is refused") {
  for (const double period :
       {0.0, -0.1, 1e9, std::numeric_limits<double>::infinity(), std::nan("")}) {
    SegmentHeader header = some_header();
    header.period_s = period;
    CHECK(decode_header(encode(header).bytes).problem != nullptr);
  }
}

TEST_CASE("a row reads back only at its place in its segment") {
  RecordRow row;
  row.time_ns = -7;
  row.period_index = 123456789012;
  row.pv = std::nan("");
  row.stem = 12.25;
  row.age_ms = 3.5F;
  row.flags = kAtHigh;
  std::vector<char> bytes(kSegmentRowBytes);
  encode(row, 9, 0xABCD, bytes);
  const auto again = decode_row(bytes, 9, 0xABCD);
  REQUIRE(again);
  CHECK(std::memcmp(&*again, &row, sizeof row) == 0);
  CHECK_FALSE(decode_row(bytes, 8, 0xABCD));
  CHECK_FALSE(decode_row(bytes, 9, 0xABCE));
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    std::vector<char> damaged = bytes;
    damaged[i] = static_cast<char>(damaged[i] ^ 1);
    INFO(i);
    CHECK_FALSE(decode_row(damaged, 9, 0xABCD));
  }
}

TEST_CASE("a row with an unknown mode, fault, quality, reason, form or limit is refused") {
  const RecordRow row;
  std::vector<char> bytes(kSegmentRowBytes);
  for (const std::size_t place :
       {offsetof(RecordRow, mode), offsetof(RecordRow, fault), offsetof(RecordRow, pv_quality),
        offsetof(RecordRow, pv_reason), offsetof(RecordRow, jacket_form),
        offsetof(RecordRow, requested_mode), offsetof(RecordRow, pv_limit)}) {
    INFO(place);
    RecordRow unknown = row;
    std::memset(reinterpret_cast<char*>(&unknown) + place, 200, 1);
    encode(unknown, 0, 0, bytes);
    CHECK_FALSE(decode_row(bytes, 0, 0));
  }
}

TEST_CASE("a row's UTC follows the monotonic clock from the segment's start") {
  RecordRow row;
  row.time_ns = 5'100'000'000;
  CHECK(utc_ns(some_header(), row) == 1'700'000'000'100'000'000);
}

}  // namespace segment_format_test
