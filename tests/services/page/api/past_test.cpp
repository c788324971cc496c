// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <fstream>
#include <limits>

#include "record/record_csv.hpp"
#include "record/segment_format.hpp"
#include "record/segment_reader.hpp"
#include "tests/services/page/support/api_rig.hpp"

namespace loopwarden::tests::past_test {
namespace {

constexpr std::int64_t kStart_ms = 1'750'000'000'000;
constexpr double kPeriod_s = 0.1;

// Writes rows of one run as the recorder does. PV is the number of the period, and the third row
// has no PV.
void write_run(const std::filesystem::path& folder, std::uint64_t sequence, std::int64_t start_ms,
               std::uint64_t first_period, std::size_t count) {
  std::filesystem::create_directories(folder);
  std::ofstream file(folder / record::segment_name(sequence), std::ios::binary);
  const auto header = record::encode(record::SegmentHeader{.sequence = sequence,
                                                           .run = sequence,
                                                           .loop = "FIC-101",
                                                           .period_s = kPeriod_s,
                                                           .start_utc_ns = start_ms * 1'000'000,
                                                           .start_monotonic_ns = 0});
  file.write(header.bytes.data(), static_cast<std::streamsize>(header.bytes.size()));
  std::array<char, record::kSegmentRowBytes> bytes{};
  for (std::uint32_t i = 0; i < count; ++i) {
    record::RecordRow row;
    row.time_ns = static_cast<std::int64_t>(i) * 100'000'000;
    row.period_index = first_period + i;
    row.pv =
        i == 2 ? std::numeric_limits<double>::quiet_NaN() : static_cast<double>(first_period + i);
    row.sp = 5.0;
    row.co = 40.0;
    row.stem = 39.5;
    row.mode = control::Mode::automatic;
    record::encode(row, i, header.crc, bytes);
    file.write(bytes.data(), bytes.size());
  }
}

std::string csv_of(ApiRig& rig) {
  http::Request request = ApiRig::get({"api", "loops", "FIC-101", "history.csv"});
  request.query["from_ms"] = std::to_string(kStart_ms - 1000);
  request.query["to_ms"] = std::to_string(kStart_ms + 60'000);
  const http::Response response = rig.answer(request);
  REQUIRE(response.status == 200);
  REQUIRE(response.source);
  std::string text;
  for (std::string part = response.source->next(); !part.empty(); part = response.source->next()) {
    text += part;
  }
  return text;
}

TEST_CASE("a recorded time is returned as a CSV record") {
  ApiRig rig(false);
  write_run(rig.settings.state_directory / "segments" / "FIC-101", 1, kStart_ms, 100, 5);
  const record::Record read = record::parse_record(csv_of(rig), "history.csv");
  REQUIRE(read.size() == 5);
  CHECK(read.period_s == Approx(kPeriod_s));
  CHECK(read.time_s.front() == 0.0);
  CHECK(read.pv.front() == 100.0);
  CHECK(std::isnan(read.pv[2]));
  CHECK(read.pv.back() == 104.0);
  CHECK(read.sp.front() == 5.0);
  CHECK(read.co.front() == 40.0);
  CHECK(read.automatic.front() == 1.0);
}

TEST_CASE("after a restart a CSV record continues by the clock, in whole periods") {
  ApiRig rig(false);
  const auto folder = rig.settings.state_directory / "segments" / "FIC-101";
  write_run(folder, 1, kStart_ms, 100, 2);
  write_run(folder, 2, kStart_ms + 1020, 0, 2);
  const std::string text = csv_of(rig);
  CHECK_THAT(text, Catch::Contains("\n0.1,101,5,40,"));
  CHECK_THAT(text, Catch::Contains("\n1,0,5,40,"));
  CHECK_THAT(text, Catch::Contains("\n1.1,1,5,40,"));
}

TEST_CASE("an empty CSV record has its head line") {
  ApiRig rig(false);
  CHECK(csv_of(rig).starts_with("time,pv,sp,co,"));
}

}  // namespace
}  // namespace loopwarden::tests::past_test
