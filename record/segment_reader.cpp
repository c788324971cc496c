// SPDX-License-Identifier: Apache-2.0
#include "record/segment_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <fstream>
#include <limits>
#include <string>
#include <system_error>

#include "record/record_csv.hpp"

namespace loopwarden::record {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kExtension = ".lwseg";
constexpr std::size_t kSequenceDigits = 10;
// Far above the writer's limit; a larger file with this name is not a segment.
constexpr std::size_t kLargestSegmentBytes = 64UL * 1024UL * 1024UL;

[[noreturn]] void fail(RecordError::Kind kind, std::string_view name, std::string_view what) {
  throw RecordError(kind, 0, 0, fmt::format("{}: {}", name, what));
}

// Returns 0 if it is not the name of a segment.
std::uint64_t sequence_in(const std::string& name) {
  if (name.size() < kSequenceDigits + kExtension.size() || !name.ends_with(kExtension)) return 0;
  const char* end = name.data() + name.size() - kExtension.size();
  std::uint64_t sequence = 0;
  const auto [stop, error] = std::from_chars(name.data(), end, sequence);
  return error == std::errc{} && stop == end ? sequence : 0;
}

}  // namespace

fs::path segment_name(std::uint64_t sequence) {
  return fmt::format("{:0{}}{}", sequence, kSequenceDigits, kExtension);
}

Segment parse_segment(std::span<const char> bytes, std::string_view name) {
  DecodedHeader decoded = decode_header(bytes);
  if (decoded.problem != nullptr) fail(RecordError::Kind::data, name, decoded.problem);
  Segment segment;
  segment.header = std::move(decoded.header);
  bytes = bytes.subspan(kSegmentHeaderBytes);

  const std::size_t row_bytes = decoded.row_bytes;
  const std::size_t places =
      std::min<std::size_t>(bytes.size() / row_bytes, std::numeric_limits<std::uint32_t>::max());
  segment.rows.reserve(places);
  std::size_t behind_last = 0;
  for (std::size_t i = 0; i < places; ++i) {
    const auto row = decode_row(bytes.subspan(i * row_bytes, row_bytes),
                                static_cast<std::uint32_t>(i), decoded.crc);
    if (!row) continue;
    segment.rows.push_back(*row);
    behind_last = i + 1;
  }
  segment.damaged_rows = behind_last - segment.rows.size();
  segment.torn_bytes = bytes.size() - behind_last * row_bytes;
  return segment;
}

Segment read_segment(const fs::path& path) {
  std::error_code error;
  const std::uintmax_t size = fs::file_size(path, error);
  if (error) fail(RecordError::Kind::io, path.string(), "can't be read: " + error.message());
  if (size > kLargestSegmentBytes) fail(RecordError::Kind::data, path.string(), "not a segment");
  std::vector<char> bytes(static_cast<std::size_t>(size));
  std::ifstream stream(path, std::ios::binary);
  stream.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  // The file may be shorter than before if the ring has deleted it: the part already read is used.
  if (!stream.is_open() || stream.bad())
    fail(RecordError::Kind::io, path.string(), "can't be read");
  bytes.resize(static_cast<std::size_t>(stream.gcount()));
  return parse_segment(bytes, path.string());
}

std::vector<SegmentFile> list_segments(const fs::path& folder) {
  std::vector<SegmentFile> segments;
  std::error_code error;
  if (!fs::exists(folder, error) && !error) return segments;
  fs::directory_iterator entry(folder, error);
  for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
    const std::uint64_t sequence = sequence_in(entry->path().filename().string());
    std::error_code gone;
    if (sequence == 0 || !fs::is_regular_file(entry->symlink_status(gone)) || gone) continue;
    const std::uintmax_t size = entry->file_size(gone);
    if (gone) continue;
    segments.push_back({entry->path(), sequence, disk_bytes(static_cast<std::size_t>(size))});
  }
  if (error) fail(RecordError::Kind::io, folder.string(), "can't be read: " + error.message());
  std::sort(segments.begin(), segments.end(),
            [](const SegmentFile& a, const SegmentFile& b) { return a.sequence < b.sequence; });
  return segments;
}

}  // namespace loopwarden::record
