// SPDX-License-Identifier: Apache-2.0
// Segment files truncated or changed at any place by a power failure or a bad disk.
#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

#include "record/record_csv.hpp"
#include "record/segment_reader.hpp"
#include "record/segment_ring.hpp"
#include "tests/support/property.hpp"
#include "tests/support/temporary_folder.hpp"

namespace segment_property_test {

using namespace loopwarden;
using namespace loopwarden::record;
using namespace loopwarden::tests::property;
using loopwarden::tests::read_file;
using loopwarden::tests::TemporaryFolder;
using loopwarden::tests::write_file;

namespace {

RecordRow any_row(std::uint64_t number_of_row) {
  RecordRow row;
  const std::uint64_t words[] = {bits(), bits(), bits()};
  // Any bits, including NaN, because the file stores rows, not numbers.
  std::memcpy(&row.sp, words, sizeof words);
  row.time_ns = static_cast<std::int64_t>(number_of_row) * 100'000'000;
  row.period_index = number_of_row;
  row.mode = coin() ? control::Mode::automatic : control::Mode::fallback;
  row.age_ms = static_cast<float>(number(0.0, 1e6));
  return row;
}

bool same(const RecordRow& a, const RecordRow& b) { return std::memcmp(&a, &b, sizeof a) == 0; }

std::vector<RecordRow> any_rows(std::uint64_t first, std::int64_t count) {
  std::vector<RecordRow> rows;
  for (std::int64_t i = 0; i < count; ++i) {
    rows.push_back(any_row(first + static_cast<std::uint64_t>(i)));
  }
  return rows;
}

// In pieces, as the historian passes them on.
void write(const std::filesystem::path& folder, const std::vector<RecordRow>& rows) {
  SegmentWriter writer({.folder = folder, .loop = "FIC-101"});
  for (std::size_t at = 0; at < rows.size();) {
    const std::size_t piece = std::min(rows.size() - at, 1 + one_of(20));
    writer.append({rows.data() + at, piece});
    at += piece;
  }
  const std::array<SegmentWriter*, 1> all{&writer};
  SegmentWriter::sync_all(all);
  require(writer.status().rows == rows.size(), "every row is on the disk");
}

}  // namespace

TEST_CASE("a truncated segment keeps every whole row before the cut",
          "[record][segment][property]") {
  for_all("cut anywhere, then gone on", 150, [] {
    const TemporaryFolder folder;
    const std::vector<RecordRow> rows = any_rows(1, integer(1, 60));
    write(folder.path(), rows);
    const std::filesystem::path file = list_segments(folder.path()).front().path;
    const std::string bytes = read_file(file);
    const std::size_t cut = one_of(bytes.size() + 1);
    write_file(file, std::string_view(bytes).substr(0, cut));

    // The daemon restarts, with a new segment.
    const std::vector<RecordRow> later = any_rows(1000, integer(1, 10));
    write(folder.path(), later);
    const std::vector<SegmentFile> files = list_segments(folder.path());
    require(files.size() == 2, "the cut segment stays, and a new one follows");
    const Segment next = read_segment(files.back().path);
    require(next.rows.size() == later.size() &&
                std::equal(next.rows.begin(), next.rows.end(), later.begin(), same),
            "the next run is whole");

    if (cut < kSegmentHeaderBytes) {
      bool refused = false;
      try {
        read_segment(file);
      } catch (const RecordError&) {
        refused = true;
      }
      require(refused, "without its header a segment is refused");
      return;
    }
    const Segment segment = read_segment(file);
    const std::size_t whole = (cut - kSegmentHeaderBytes) / kSegmentRowBytes;
    require(segment.rows.size() == whole, "every whole row, and no other");
    require(std::equal(segment.rows.begin(), segment.rows.end(), rows.begin(), same),
            "as it was written");
    require(segment.torn_bytes == (cut - kSegmentHeaderBytes) % kSegmentRowBytes,
            "the rest is counted");
  });
}

TEST_CASE("a damaged row is left out, and no other row is lost", "[record][segment][property]") {
  for_all("bytes changed anywhere after the header", 150, [] {
    const TemporaryFolder folder;
    const std::vector<RecordRow> rows = any_rows(1, integer(1, 60));
    write(folder.path(), rows);
    const std::filesystem::path file = list_segments(folder.path()).front().path;
    std::string bytes = read_file(file);
    std::vector<bool> damaged(rows.size(), false);
    const std::int64_t places = integer(1, 4);
    for (std::int64_t i = 0; i < places; ++i) {
      const std::size_t at = one_of(bytes.size() - kSegmentHeaderBytes);
      const std::size_t row = at / kSegmentRowBytes;
      if (damaged[row]) continue;  // a second change could undo the first
      damaged[row] = true;
      char& byte = bytes[kSegmentHeaderBytes + at];
      byte = static_cast<char>(byte ^ static_cast<char>(integer(1, 127)));
    }
    write_file(file, bytes);
    const Segment segment = read_segment(file);
    std::size_t at = 0;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      if (damaged[i]) continue;
      require(at < segment.rows.size() && same(segment.rows[at], rows[i]), "a sound row is there");
      ++at;
    }
    require(at == segment.rows.size(), "no row that was not written");
    require(kSegmentHeaderBytes + segment.torn_bytes +
                    (segment.rows.size() + segment.damaged_rows) * kSegmentRowBytes ==
                bytes.size(),
            "every byte is accounted for");
  });
}

}  // namespace segment_property_test
