// SPDX-License-Identifier: Apache-2.0
#include "record/segment_reader.hpp"

#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "record/record_csv.hpp"
#include "tests/support/temporary_folder.hpp"

namespace segment_reader_test {

using namespace loopwarden::record;
using loopwarden::tests::TemporaryFolder;
using loopwarden::tests::write_file;
namespace fs = std::filesystem;

namespace {

// A segment of `rows` rows with period indices from 0.
std::vector<char> segment_bytes(std::uint32_t rows) {
  const EncodedHeader header = encode(SegmentHeader{.sequence = 3, .run = 3, .period_s = 0.1});
  std::vector<char> bytes(header.bytes.begin(), header.bytes.end());
  for (std::uint32_t i = 0; i < rows; ++i) {
    RecordRow row;
    row.period_index = i;
    bytes.resize(bytes.size() + kSegmentRowBytes);
    encode(row, i, header.crc, std::span(bytes).last(kSegmentRowBytes));
  }
  return bytes;
}

}  // namespace

TEST_CASE("a whole segment is read without loss") {
  const Segment segment = parse_segment(segment_bytes(5), "s");
  CHECK(segment.header.sequence == 3);
  REQUIRE(segment.rows.size() == 5);
  CHECK(segment.rows[4].period_index == 4);
  CHECK(segment.damaged_rows == 0);
  CHECK(segment.torn_bytes == 0);
}

TEST_CASE("for any length after a power failure, the whole rows before it are read") {
  const std::vector<char> bytes = segment_bytes(3);
  for (std::size_t length = kSegmentHeaderBytes; length <= bytes.size(); ++length) {
    const Segment segment = parse_segment(std::span(bytes).first(length), "s");
    const std::size_t whole = (length - kSegmentHeaderBytes) / kSegmentRowBytes;
    INFO(length);
    REQUIRE(segment.rows.size() == whole);
    REQUIRE(segment.torn_bytes == length - kSegmentHeaderBytes - whole * kSegmentRowBytes);
    REQUIRE(segment.damaged_rows == 0);
  }
}

TEST_CASE("a tail of zeros, as file systems leave it, is a torn tail") {
  std::vector<char> bytes = segment_bytes(3);
  bytes.resize(bytes.size() + 10 * kSegmentRowBytes + 7, '\0');
  const Segment segment = parse_segment(bytes, "s");
  CHECK(segment.rows.size() == 3);
  CHECK(segment.torn_bytes == 10 * kSegmentRowBytes + 7);
}

TEST_CASE("a damaged row loses only itself") {
  std::vector<char> bytes = segment_bytes(5);
  bytes[kSegmentHeaderBytes + 2 * kSegmentRowBytes + 17] ^= 0x40;
  const Segment segment = parse_segment(bytes, "s");
  REQUIRE(segment.rows.size() == 4);
  CHECK(segment.rows[2].period_index == 3);
  CHECK(segment.damaged_rows == 1);
  CHECK(segment.torn_bytes == 0);
}

TEST_CASE("rows of another segment are not mistaken for this one's") {
  std::vector<char> bytes = segment_bytes(2);
  const EncodedHeader other = encode(SegmentHeader{.sequence = 4, .run = 3, .period_s = 0.1});
  std::copy(other.bytes.begin(), other.bytes.end(), bytes.begin());
  const Segment segment = parse_segment(bytes, "s");
  CHECK(segment.rows.empty());
  CHECK(segment.torn_bytes == 2 * kSegmentRowBytes);
}

TEST_CASE("an invalid segment is refused with its name") {
  const auto message = [](std::string_view text) -> std::string {
    try {
      parse_segment(text, "x.lwseg");
    } catch (const RecordError& error) {
      return error.what();
    }
    return "no failure";
  };
  CHECK(message("") == "x.lwseg: too short for a segment");
  CHECK(message(std::string(600, 'a')) == "x.lwseg: not a segment");
}

TEST_CASE("only a folder's segments are listed, by number") {
  const TemporaryFolder folder;
  CHECK(list_segments(folder / "absent").empty());
  for (const char* name : {"0000000010.lwseg", "0000000009.lwseg", "12345678901.lwseg"}) {
    write_file(folder / name, "x");
  }
  for (const char* name :
       {"notes.txt", "9.lwseg", "000000000a.lwseg", "0000000000.lwseg", "0000000011.lwseg.tmp"}) {
    write_file(folder / name, "x");
  }
  fs::create_directory(folder / "0000000012.lwseg");
  fs::create_symlink(folder / "notes.txt", folder / "0000000013.lwseg");
  const auto segments = list_segments(folder.path());
  REQUIRE(segments.size() == 3);
  CHECK(segments[0].sequence == 9);
  CHECK(segments[1].sequence == 10);
  CHECK(segments[2].sequence == 12345678901);
  CHECK(segments[0].disk_bytes == 4096);
  CHECK(segment_name(9) == "0000000009.lwseg");
  CHECK(segment_name(12345678901) == "12345678901.lwseg");
  CHECK_THROWS_AS(list_segments(folder / "notes.txt"), RecordError);
}

TEST_CASE("a segment that was deleted before it is read is an error of the disk") {
  const TemporaryFolder folder;
  try {
    read_segment(folder / "0000000001.lwseg");
    FAIL("no failure");
  } catch (const RecordError& error) {
    CHECK(error.kind() == RecordError::Kind::io);
  }
}

TEST_CASE(
    "segments of version 1 are read: one pair of columns to the jacket or to the compensator") {
  const fs::path folder = LOOPWARDEN_SOURCE_DIR "/tests/record/data/version-1";
  const Segment jacket = read_segment(folder / "jacket" / "0000000001.lwseg");
  CHECK(jacket.header.loop == "FIC-101");
  REQUIRE(jacket.rows.size() == 40);
  CHECK(jacket.damaged_rows == 0);
  CHECK(jacket.torn_bytes == 0);
  CHECK(jacket.rows[39].sp == 5.0);
  CHECK(jacket.rows[39].co == 3.6572265625);
  CHECK(jacket.rows[39].jacket_rate == -0.020023234F);
  CHECK(jacket.rows[39].jacket_rate_shadow == -0.020023234F);
  CHECK((jacket.rows[39].flags & (kJacketActs | kCompensatorActs)) == kJacketActs);
  const Segment compensator = read_segment(folder / "compensator" / "0000000001.lwseg");
  REQUIRE(compensator.rows.size() == 40);
  CHECK(compensator.rows[39].compensator == 0.2F);
  CHECK(compensator.rows[39].compensator_shadow == 0.2F);
  CHECK((compensator.rows[39].flags & (kJacketActs | kCompensatorActs)) == kCompensatorActs);
  for (const RecordRow& row : jacket.rows) CHECK(row.compensator == 0.0F);
  for (const RecordRow& row : compensator.rows) CHECK(row.jacket_rate == 0.0F);
}

TEST_CASE("one damaged row of a segment of version 1 loses only itself") {
  std::string text = loopwarden::tests::read_file(
      LOOPWARDEN_SOURCE_DIR "/tests/record/data/version-1/jacket/0000000001.lwseg");
  text[kSegmentHeaderBytes + 3 * 80 + 5] ^= 1;
  text.resize(text.size() - 1);
  const Segment segment = parse_segment(text, "x.lwseg");
  CHECK(segment.rows.size() == 38);
  CHECK(segment.damaged_rows == 1);
  CHECK(segment.torn_bytes == 79);
}

}  // namespace segment_reader_test
