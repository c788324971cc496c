// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string_view>
#include <vector>

#include "record/record_row.hpp"
#include "record/segment_format.hpp"

namespace loopwarden::record {

struct Segment {
  SegmentHeader header;
  std::vector<RecordRow> rows;   // the undamaged ones, in order
  std::size_t damaged_rows = 0;  // skipped between them
  std::size_t torn_bytes = 0;    // after the last row, ignored
};

// Throw RecordError if the segment is invalid or has an unknown version.
Segment parse_segment(std::span<const char> bytes, std::string_view name);
Segment read_segment(const std::filesystem::path& path);

// Returns the segments of a folder by their names, oldest first; empty if there is no such folder.
// Throws RecordError if the folder can't be read.
struct SegmentFile {
  std::filesystem::path path;
  std::uint64_t sequence = 0;
  std::size_t disk_bytes = 0;  // in whole blocks, as counted for the limit
};
std::vector<SegmentFile> list_segments(const std::filesystem::path& folder);

// Returns "0000000042.lwseg".
std::filesystem::path segment_name(std::uint64_t sequence);
// Returns the disk space of a file of `bytes`.
constexpr std::size_t disk_bytes(std::size_t bytes) noexcept {
  return (bytes + 4095) / 4096 * 4096;
}

}  // namespace loopwarden::record
