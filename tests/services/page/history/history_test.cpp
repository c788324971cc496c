// SPDX-License-Identifier: Apache-2.0
#include "services/page/history/history.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <functional>

#include "record/segment_ring.hpp"
#include "tests/support/property.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::tests::history_test {

using namespace page::history;

constexpr std::int64_t kStart_ms = 1'750'000'000'000;

// A segment file as the recorder writes it, with a clock set by the test.
struct Written {
  std::uint64_t sequence = 1;
  std::uint64_t run = 1;
  std::int64_t start_ms = kStart_ms;
  std::int64_t step_ms = 100;
  std::vector<record::RecordRow> rows;

  void to(const std::filesystem::path& folder) const {
    std::filesystem::create_directories(folder);
    std::ofstream file(folder / record::segment_name(sequence), std::ios::binary);
    const auto header =
        record::encode(record::SegmentHeader{.sequence = sequence,
                                             .run = run,
                                             .loop = "FIC-101",
                                             .period_s = 0.1,
                                             .start_utc_ns = start_ms * 1'000'000,
                                             .start_monotonic_ns = rows.front().time_ns});
    file.write(header.bytes.data(), static_cast<std::streamsize>(header.bytes.size()));
    std::array<char, record::kSegmentRowBytes> bytes{};
    for (std::uint32_t i = 0; i < rows.size(); ++i) {
      record::encode(rows[i], i, header.crc, bytes);
      file.write(bytes.data(), bytes.size());
    }
  }
};

record::RecordRow row_at(std::uint64_t period, double pv) {
  record::RecordRow row;
  row.time_ns = static_cast<std::int64_t>(period) * 100'000'000;
  row.period_index = period;
  row.pv = pv;
  row.sp = 5.0;
  row.co = 40.0;
  row.stem = 39.5;
  row.mode = control::Mode::automatic;
  return row;
}

std::vector<record::RecordRow> wave(std::uint64_t first, std::size_t count) {
  std::vector<record::RecordRow> rows;
  for (std::uint64_t i = first; i < first + count; ++i) {
    rows.push_back(row_at(i, 5.0 + std::sin(static_cast<double>(i) * 0.01)));
  }
  return rows;
}

std::vector<Block> nothing(const std::optional<Block>&) { return {}; }

Past past_of(const TemporaryFolder& folder, Stretch stretch, std::size_t points) {
  History history;
  return history.past(folder.path(), stretch, points, nothing);
}

float greatest(const Past& past, Column column = kPv) {
  float most = -1e30F;
  for (const float value : past.curves.columns[column]) most = std::fmax(most, value);
  return most;
}

std::size_t gaps(const Past& past) {
  return static_cast<std::size_t>(
      std::count(past.curves.mode.begin(), past.curves.mode.end(), std::int16_t{-1}));
}

TEST_CASE("a short stretch has every row unchanged") {
  const TemporaryFolder folder;
  Written{.rows = wave(0, 1000)}.to(folder.path());
  const Past past = past_of(folder, {kStart_ms + 10'000, kStart_ms + 19'900}, 1000);
  REQUIRE(past.curves.t_ms.size() == 100);
  CHECK_FALSE(past.bucket_ms);
  CHECK(past.curves.t_ms.front() == kStart_ms + 10'000);
  CHECK(past.curves.columns[kPv][0] == Approx(5.0 + std::sin(1.0)));
  CHECK(past.curves.columns[kStem][0] == 39.5F);
  CHECK(past.curves.mode[0] == 1);
  CHECK(past.oldest_ms == kStart_ms);
  CHECK(past.newest_ms == kStart_ms + 99'900);
}

TEST_CASE("a spike of one sample is in every picture, at every width") {
  const TemporaryFolder folder;
  const std::size_t place = GENERATE(0UL, 1UL, 63UL, 64UL, 4095UL, 77'777UL, 149'999UL);
  Written written{.rows = wave(0, 150'000)};
  written.rows[place].pv = 9.5;
  written.to(folder.path());
  for (const std::size_t points : {4UL, 10UL, 100UL, 1000UL, 4000UL}) {
    const Past past = past_of(folder, {kStart_ms, kStart_ms + 15'000'000}, points);
    CAPTURE(place, points);
    CHECK(past.curves.t_ms.size() <= points);
    CHECK(greatest(past) == 9.5F);
    REQUIRE(past.bucket_ms);
    // The time is right within a bucket and its block.
    const auto spike =
        std::find(past.curves.columns[kPv].begin(), past.curves.columns[kPv].end(), 9.5F);
    const auto at =
        past.curves.t_ms[static_cast<std::size_t>(spike - past.curves.columns[kPv].begin())];
    const auto truth = kStart_ms + static_cast<std::int64_t>(place) * 100;
    CHECK(std::abs(static_cast<double>(at - truth)) <= 1.3 * *past.bucket_ms + 100.0);
  }
}

TEST_CASE(
    "a bucket is drawn by its first value, its extremes in order of time, and its last value") {
  Decimator decimator(0, 1000.0);
  const auto add = [&](std::uint64_t period, double pv) {
    decimator.add(block_of(row_at(period, pv), static_cast<std::int64_t>(period) * 100, 1, 0));
  };
  add(0, 5.0);
  add(3, 9.0);
  add(6, 1.0);
  add(9, 4.0);
  add(12, 1.0);
  add(15, 9.0);
  add(21, 7.0);
  const Curves curves = decimator.take();
  CHECK(curves.columns[kPv] == std::vector<float>{5.0F, 9.0F, 1.0F, 4.0F, 1.0F, 9.0F, 7.0F});
  CHECK(curves.t_ms == std::vector<std::int64_t>{0, 300, 600, 900, 1200, 1500, 2100});
  CHECK(curves.sample == std::vector<std::uint8_t>{1, 0, 0, 1, 1, 1, 1});
}

TEST_CASE("a smooth fall stays smooth at every width of the buckets") {
  const TemporaryFolder folder;
  std::vector<record::RecordRow> rows;
  for (std::uint64_t i = 0; i < 50'000; ++i) {
    rows.push_back(row_at(i, 9.0 - static_cast<double>(i) * 1e-4));
  }
  Written{.rows = rows}.to(folder.path());
  for (const std::size_t points : {4UL, 50UL, 400UL, 2000UL}) {
    CAPTURE(points);
    const Past past = past_of(folder, {kStart_ms, kStart_ms + 4'999'900}, points);
    REQUIRE(past.bucket_ms);
    const auto& pv = past.curves.columns[kPv];
    CHECK(std::is_sorted(pv.rbegin(), pv.rend()));
  }
}

TEST_CASE("a gap gives a row without values") {
  const TemporaryFolder folder;
  Written written{.rows = wave(0, 2000)};
  SECTION("rows of a run") {
    written.rows.erase(written.rows.begin() + 500, written.rows.begin() + 600);
    written.to(folder.path());
    const Past whole = past_of(folder, {kStart_ms + 45'000, kStart_ms + 65'000}, 1000);
    CHECK(gaps(whole) == 1);
    CHECK(whole.curves.t_ms.size() == 102);
    CHECK(gaps(past_of(folder, {kStart_ms, kStart_ms + 200'000}, 200)) == 1);
  }
  SECTION("gaps as short as the monitor accepts are drawn over") {
    written.rows.erase(written.rows.begin() + 500, written.rows.begin() + 504);
    written.to(folder.path());
    CHECK(gaps(past_of(folder, {kStart_ms, kStart_ms + 200'000}, 4000)) == 0);
  }
  SECTION("a restart") {
    written.to(folder.path());
    Written{.sequence = 2, .run = 2, .start_ms = kStart_ms + 260'000, .rows = wave(0, 500)}.to(
        folder.path());
    const Past past = past_of(folder, {kStart_ms, kStart_ms + 400'000}, 4000);
    CHECK(gaps(past) == 1);
    CHECK(past.curves.t_ms.size() == 2501);
    CHECK(past.newest_ms == kStart_ms + 309'900);
  }
  SECTION("a PV that is not a number stays without a value") {
    written.rows[500].pv = std::nan("");
    written.to(folder.path());
    const Past past = past_of(folder, {kStart_ms + 49'900, kStart_ms + 50'100}, 100);
    REQUIRE(past.curves.t_ms.size() == 3);
    CHECK(std::isnan(past.curves.columns[kPv][1]));
    CHECK(past.curves.columns[kSp][1] == 5.0F);
    CHECK(gaps(past) == 0);
  }
}

TEST_CASE("a bad segment costs only its own rows") {
  const TemporaryFolder folder;
  Written{.rows = wave(0, 500)}.to(folder.path());
  Written{.sequence = 3, .start_ms = kStart_ms + 100'000, .rows = wave(1000, 500)}.to(
      folder.path());
  write_file(folder / "0000000002.lwseg", "this is no segment at all");
  const Past past = past_of(folder, {kStart_ms, kStart_ms + 200'000}, 4000);
  REQUIRE(past.unreadable.size() == 1);
  CHECK(past.unreadable[0].find("0000000002.lwseg") != std::string::npos);
  CHECK(past.curves.t_ms.size() == 1001);
  SECTION("damaged rows cost only themselves") {
    std::fstream file(folder / "0000000001.lwseg", std::ios::binary | std::ios::in | std::ios::out);
    for (const int place : {0, 100, 101, 499}) {
      file.seekp(512 + 88 * place + 30);
      file.put('\x55');
    }
    file.close();
    const Past damaged = past_of(folder, {kStart_ms, kStart_ms + 49'900}, 4000);
    CHECK(damaged.curves.t_ms.size() == 496);
  }
}

TEST_CASE("newer rows come from the daemon's memory") {
  const TemporaryFolder folder;
  History history;
  const auto newer = [](const std::optional<Block>& newest) {
    std::vector<Block> rows;
    const std::uint64_t first = newest ? newest->last_period + 1 : 0;
    const std::int64_t at = newest ? newest->last_ms + 100 : kStart_ms;
    for (std::uint64_t i = 0; i < 20; ++i) {
      rows.push_back(
          block_of(row_at(first + i, 7.0), at + static_cast<std::int64_t>(i) * 100, 0, 0));
    }
    return rows;
  };
  SECTION("after the segments, without a gap") {
    Written{.rows = wave(0, 100)}.to(folder.path());
    const Past past = history.past(folder.path(), {kStart_ms, kStart_ms + 60'000}, 1000, newer);
    CHECK(past.curves.t_ms.size() == 120);
    CHECK(gaps(past) == 0);
    CHECK(past.newest_ms == kStart_ms + 11'900);
  }
  SECTION("a loop without a record") {
    const Past past = history.past(folder / "none", {kStart_ms, kStart_ms + 60'000}, 1000, newer);
    CHECK(past.curves.t_ms.size() == 20);
    CHECK(past.oldest_ms == kStart_ms);
  }
}

TEST_CASE("the memory for summaries is bounded") {
  const TemporaryFolder folder;
  SummaryStore store(200'000);
  for (std::uint64_t i = 1; i <= 20; ++i) {
    Written{.sequence = i,
            .start_ms = kStart_ms + static_cast<std::int64_t>(i),
            .rows = wave(0, 20'000)}
        .to(folder.path());
    const auto path = folder.path() / record::segment_name(i);
    CHECK(store.get(path, SegmentRows(path))->levels[0].size() == 313);
  }
  CHECK(store.bytes() <= 200'000);
}

TEST_CASE("all rows in pieces") {
  const TemporaryFolder folder;
  Written{.rows = wave(0, 10'000)}.to(folder.path());
  Written{.sequence = 2, .start_ms = kStart_ms + 1'000'000, .rows = wave(10'000, 10'000)}.to(
      folder.path());
  RowReader reader(folder.path(), {kStart_ms + 50'000, kStart_ms + 1'500'000});
  std::size_t count = 0;
  std::int64_t last = 0;
  for (auto rows = reader.next(); !rows.empty(); rows = reader.next()) {
    for (const auto& row : rows) {
      CHECK(row.utc_ms > last);
      last = row.utc_ms;
      ++count;
    }
  }
  CHECK(count == 9500 + 5001);
}

TEST_CASE("for all rows the picture keeps their extremes, rises in time and has its size") {
  property::for_all("decimation", 200, [] {
    std::vector<float> values(1 + property::one_of(500));
    const std::size_t points = kRowsPerBucket + property::one_of(50);
    const double span_ms = 150.0 * static_cast<double>(values.size());
    Decimator decimator(0, span_ms / static_cast<double>(points / kRowsPerBucket));
    std::uint64_t period = 0;
    for (float& value : values) {
      value = static_cast<float>(property::integer(-1000, 1000));
      period += 1 + property::one_of(3) * property::one_of(2);
      decimator.add(block_of(row_at(period, static_cast<double>(value)),
                             static_cast<std::int64_t>(period) * 50, 1, 0));
    }
    const Curves curves = decimator.take();
    property::require(std::is_sorted(curves.t_ms.begin(), curves.t_ms.end(), std::less_equal<>()),
                      "time rises");
    property::require(curves.t_ms.size() <= points + 1, "as many rows as asked for");
    const auto& pv = curves.columns[kPv];
    property::require(pv.front() == values.front() && pv.back() == values.back(),
                      "it begins and ends where the values do");
    const auto real = [](float a, float b) { return !std::isnan(a) && (std::isnan(b) || a < b); };
    property::require(*std::min_element(pv.begin(), pv.end(), real) ==
                          *std::min_element(values.begin(), values.end()),
                      "the least is kept");
    float most = -1e30F;
    for (const float value : pv) most = std::fmax(most, value);
    property::require(most == *std::max_element(values.begin(), values.end()),
                      "the greatest is kept");
  });
}

}  // namespace loopwarden::tests::history_test
