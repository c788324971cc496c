// SPDX-License-Identifier: Apache-2.0
#include "record/segment_export.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include "record/record_csv.hpp"
#include "record/segment_format.hpp"
#include "record/segment_reader.hpp"
#include "tests/support/temporary_folder.hpp"

namespace segment_export_test {

using namespace loopwarden::record;
using loopwarden::numeric::missing;
using loopwarden::tests::read_file;
using loopwarden::tests::TemporaryFolder;
using loopwarden::tests::write_file;
namespace fs = std::filesystem;

namespace {

constexpr std::int64_t kNoonUtc = 1'763'726'400'000'000'000;  // 2025-11-21 12:00:00 UTC

// A segment with rows at the given period indices. Period 0 is at noon.
void add_segment(const fs::path& folder, std::uint64_t sequence, std::uint64_t run,
                 const std::vector<std::uint64_t>& periods) {
  const EncodedHeader header = encode(SegmentHeader{.sequence = sequence,
                                                    .run = run,
                                                    .loop = "FIC/101",
                                                    .period_s = 0.1,
                                                    .start_utc_ns = kNoonUtc,
                                                    .start_monotonic_ns = 0});
  std::string bytes(header.bytes.begin(), header.bytes.end());
  for (std::uint32_t i = 0; i < periods.size(); ++i) {
    RecordRow row;
    row.period_index = periods[i];
    row.time_ns = static_cast<std::int64_t>(periods[i]) * 100'000'000;
    row.sp = 5.0;
    row.pv = periods[i] == 2 ? std::nan("") : 0.5 * static_cast<double>(periods[i]);
    row.co = 40.0;
    row.stem = std::nan("");
    row.calculated = 0.1F;
    row.mode = loopwarden::control::Mode::fallback;
    bytes.resize(bytes.size() + kSegmentRowBytes);
    encode(row, i, header.crc, std::span(bytes).last(kSegmentRowBytes));
  }
  write_file(folder / segment_name(sequence), bytes);
}

}  // namespace

TEST_CASE("segments of one run become one record") {
  const TemporaryFolder folder;
  add_segment(folder / "in", 1, 1, {0, 1, 2});
  add_segment(folder / "in", 2, 1, {3, 4});
  const ExportResult result = export_csv(folder / "in", folder / "out");
  REQUIRE(result.records.size() == 1);
  CHECK(result.records[0].path == folder / "out" / "FIC_101_20251121T120000Z.csv");
  CHECK(result.records[0].rows == 5);
  CHECK(result.records[0].filled_rows == 0);
  CHECK(result.records[0].start_utc_ns == kNoonUtc);
  const Record record = read_record(result.records[0].path);
  CHECK(record.size() == 5);
  CHECK(record.period_s == 0.1);
  CHECK(record.time_s[3] == 0.3);
  CHECK(record.pv[4] == 2.0);
  CHECK(record.sp[0] == 5.0);
  CHECK(record.co[0] == 40.0);
  CHECK(missing(record.pv) == 1);
  CHECK(missing(record.stem) == 5);
  CHECK_THAT(read_file(result.records[0].path),
             Catch::StartsWith(
                 "time,pv,sp,co,stem,calculated,jacket,jacket_shadow,mode,"
                 "requested_mode,fault,pv_quality,pv_reason,flags,jacket_form,age_ms,compensator,"
                 "compensator_shadow,pv_limit\n0,0,5,40,,0.1,0,0,2,0,0,0,0,0,0,0,0,0,0\n"));
}

TEST_CASE("a short gap becomes rows with empty cells, a long one ends the file") {
  const TemporaryFolder folder;
  add_segment(folder / "in", 1, 1, {0, 1, 4, 5, 17, 18});
  ExportSettings settings;
  settings.longest_filled_gap = 10;
  const ExportResult result = export_csv(folder / "in", folder / "out", settings);
  REQUIRE(result.records.size() == 2);
  CHECK(result.records[0].rows == 6);
  CHECK(result.records[0].filled_rows == 2);
  const Record first = read_record(result.records[0].path);
  CHECK(std::isnan(first.sp[2]));
  CHECK(std::isnan(first.sp[3]));
  CHECK(first.sp[4] == 5.0);
  CHECK(result.records[1].rows == 2);
  CHECK(read_record(result.records[1].path).time_s[0] == 0.0);
  CHECK(result.records[1].path == folder / "out" / "FIC_101_20251121T120001Z.csv");

  settings.longest_filled_gap = 11;
  CHECK(export_csv(folder / "in", folder / "out", settings).records.size() == 1);
}

TEST_CASE("a restart begins a new file, numbered within the same second") {
  const TemporaryFolder folder;
  add_segment(folder / "in", 1, 1, {0, 1});
  add_segment(folder / "in", 2, 2, {2, 3});
  add_segment(folder / "in", 3, 2, {1, 2});
  const ExportResult result = export_csv(folder / "in", folder / "out");
  REQUIRE(result.records.size() == 3);
  CHECK(result.records[1].path.filename() == "FIC_101_20251121T120000Z_2.csv");
  CHECK(result.records[2].path.filename() == "FIC_101_20251121T120000Z_3.csv");
}

TEST_CASE("only the requested time is exported") {
  const TemporaryFolder folder;
  add_segment(folder / "in", 1, 1, {0, 1, 2, 3, 4, 5});
  ExportSettings settings;
  settings.from_utc_ns = kNoonUtc + 100'000'000;
  settings.to_utc_ns = kNoonUtc + 400'000'000;
  const ExportResult result = export_csv(folder / "in", folder / "out", settings);
  REQUIRE(result.records.size() == 1);
  CHECK(result.records[0].rows == 3);
  CHECK(read_record(result.records[0].path).pv[0] == 0.5);
}

TEST_CASE("unusable files are reported and don't stop the export") {
  const TemporaryFolder folder;
  add_segment(folder / "in", 1, 1, {0, 1, 2, 3});
  const fs::path damaged = folder / "in" / "0000000001.lwseg";
  std::string bytes = read_file(damaged);
  bytes[kSegmentHeaderBytes + kSegmentRowBytes] ^= 1;
  bytes.resize(bytes.size() - 1);
  write_file(damaged, bytes);
  write_file(folder / "in" / "0000000002.lwseg", "nonsense");
  add_segment(folder / "in", 3, 3, {100});
  const ExportResult result = export_csv(folder / "in", folder / "out");
  REQUIRE(result.records.size() == 1);
  CHECK(result.records[0].rows == 3);
  CHECK(result.records[0].filled_rows == 1);
  CHECK(result.damaged_rows == 1);
  CHECK(result.torn_bytes == kSegmentRowBytes - 1);
  CHECK(result.single_rows == 1);
  REQUIRE(result.unreadable.size() == 1);
  CHECK_THAT(result.unreadable[0], Catch::Contains("0000000002.lwseg: too short"));
  // Only the record is left, without a temporary file for the single row.
  CHECK(std::distance(fs::directory_iterator(folder / "out"), fs::directory_iterator()) == 1);
}

TEST_CASE("without segments there are no records; an unwritable place is an error") {
  const TemporaryFolder folder;
  CHECK(export_csv(folder / "absent", folder / "out").records.empty());
  write_file(folder / "file", "x");
  CHECK_THROWS_AS(export_csv(folder / "absent", folder / "file" / "out"), RecordError);
}

TEST_CASE("old and new segments of a folder become one record, with the old and new columns") {
  const fs::path data = LOOPWARDEN_SOURCE_DIR "/tests/record/data/version-1/jacket";
  const TemporaryFolder folder;
  const ExportResult result = export_csv(data, folder / "out");
  REQUIRE(result.records.size() == 1);
  CHECK(result.unreadable.empty());
  // The export by the program version of that time.
  std::istringstream then(read_file(data / "exported.csv"));
  std::istringstream now(read_file(result.records[0].path));
  std::string old_line;
  std::string line;
  std::size_t rows = 0;
  for (; std::getline(then, old_line); ++rows) {
    REQUIRE(std::getline(now, line));
    CHECK(line == old_line + (rows == 0 ? ",compensator,compensator_shadow,pv_limit" : ",0,0,0"));
  }
  CHECK(rows == 41);

  // The present daemon continues in the same folder.
  fs::create_directories(folder / "in");
  fs::copy_file(data / "0000000001.lwseg", folder / "in" / "0000000001.lwseg");
  add_segment(folder / "in", 2, 2, {0, 1});
  CHECK(export_csv(folder / "in", folder / "both").records.size() == 2);
}

}  // namespace segment_export_test
