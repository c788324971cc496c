// SPDX-License-Identifier: Apache-2.0
// Reads any bytes as a segment file: first unchanged, then with corrected check sums, so that the
// code after the check is reached. The rows are exported and the CSV files read again.
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>
#include <vector>

#include "record/record_csv.hpp"
#include "record/segment_export.hpp"
#include "record/segment_format.hpp"
#include "record/segment_reader.hpp"

namespace {

namespace fs = std::filesystem;
using namespace loopwarden::record;
using loopwarden::numeric::missing;

void require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "not kept: %s\n", what);
  std::abort();
}

void check_parse(std::span<const char> bytes) {
  try {
    const Segment segment = parse_segment(bytes, "input");
    require(kSegmentHeaderBytes + segment.torn_bytes +
                    (segment.rows.size() + segment.damaged_rows) * decode_header(bytes).row_bytes ==
                bytes.size(),
            "every byte is accounted for");
  } catch (const RecordError& error) {
    require(std::string_view(error.what()).starts_with("input: "),
            "the file's name in the message");
  }
}

// Puts correct check sums around the header fields and rows in `bytes`.
std::vector<char> put_right(std::span<const char> bytes) {
  SegmentHeader header{.sequence = 1, .run = 1, .loop = "F/1", .period_s = 0.1};
  const auto take = [&bytes](auto& field) {
    if (bytes.size() < sizeof field) return;
    std::memcpy(&field, bytes.data(), sizeof field);
    bytes = bytes.subspan(sizeof field);
  };
  take(header.run);
  take(header.period_s);
  take(header.start_utc_ns);
  take(header.start_monotonic_ns);
  const EncodedHeader encoded = encode(header);
  std::vector<char> segment(encoded.bytes.begin(), encoded.bytes.end());
  for (std::uint32_t i = 0; bytes.size() >= sizeof(RecordRow); ++i) {
    RecordRow row;
    take(row);
    segment.resize(segment.size() + kSegmentRowBytes);
    encode(row, i, encoded.crc, std::span(segment).last(kSegmentRowBytes));
  }
  segment.insert(segment.end(), bytes.begin(), bytes.end());
  return segment;
}

const fs::path& scratch() {
  static const fs::path path = "/dev/shm/loopwarden_segment_fuzz_" + std::to_string(::getpid());
  return path;
}

void check_export(const std::vector<char>& raw, const std::vector<char>& sound) {
  const fs::path in = scratch() / "in";
  const fs::path out = scratch() / "out";
  fs::remove_all(out);
  fs::create_directories(in);
  const auto put = [&in](std::uint64_t sequence, const std::vector<char>& bytes) {
    std::ofstream(in / segment_name(sequence), std::ios::binary)
        .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  };
  put(1, sound);
  put(2, raw);
  put(3, sound);
  const ExportResult result =
      export_csv(in, out, {.from_utc_ns = {}, .to_utc_ns = {}, .longest_filled_gap = 20});
  for (const ExportedRecord& exported : result.records) {
    const Record record = read_record(exported.path);
    require(record.size() == exported.rows, "as many rows as told");
    require(missing(record.pv) >= exported.filled_rows, "gaps stay gaps");
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::vector<char> raw(data, data + size);
  check_parse(raw);
  const std::vector<char> sound = put_right(raw);
  check_parse(sound);
  check_export(raw, sound);
  return 0;
}
