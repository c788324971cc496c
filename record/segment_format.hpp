// SPDX-License-Identifier: Apache-2.0
// How a segment looks on the disk: a header of 512 bytes, then rows of 88, little-endian, each with
// a CRC-32 (IEEE 802.3). A row's CRC starts from its header's, so that a row of an older segment
// that a power failure left in the same place of the disk is not taken for one of this segment.
//
// Version 2. Version 1 had rows of 80 bytes, with one pair of columns for jacket and compensator. It is
// still read: the pair is the jacket's where the row has a form of it, else the compensator's. A loop that
// had both, which was of use with one of them in shadow only, can't be told from one with a jacket.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "record/record_row.hpp"

namespace loopwarden::record {

inline constexpr std::size_t kSegmentHeaderBytes = 512;
inline constexpr std::size_t kSegmentRowBytes = sizeof(RecordRow) + 8;

struct SegmentHeader {
  std::uint64_t sequence = 0;           // counts the segments of a loop
  std::uint64_t run = 0;                // sequence of the first segment since the daemon's start
  std::string loop{};                   // at most 63 bytes are kept
  double period_s = 0.0;                // s
  std::int64_t start_utc_ns = 0;        // when the first row was taken
  std::int64_t start_monotonic_ns = 0;  // RecordRow::time_ns of the first row
};

// UTC of a row, ns. The clock that was read at the start of the segment is trusted for its length.
constexpr std::int64_t utc_ns(const SegmentHeader& header, const RecordRow& row) noexcept {
  // Unsigned: a damaged clock value may not overflow.
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(header.start_utc_ns) +
                                   static_cast<std::uint64_t>(row.time_ns) -
                                   static_cast<std::uint64_t>(header.start_monotonic_ns));
}

struct EncodedHeader {
  std::array<char, kSegmentHeaderBytes> bytes;
  std::uint32_t crc;  // the start of the rows' CRCs
};
EncodedHeader encode(const SegmentHeader& header) noexcept;

struct DecodedHeader {
  SegmentHeader header;
  std::uint32_t crc = 0;
  std::size_t row_bytes = kSegmentRowBytes;  // of this segment's version
  const char* problem = nullptr;             // null: the header is sound
};
DecodedHeader decode_header(std::span<const char> bytes);

// `bytes` holds kSegmentRowBytes.
void encode(const RecordRow& row, std::uint32_t index, std::uint32_t header_crc,
            std::span<char> bytes) noexcept;
// `bytes` holds a row of the size that the header told. Nothing if that is not the undamaged row `index` of
// the segment.
std::optional<RecordRow> decode_row(std::span<const char> bytes, std::uint32_t index,
                                    std::uint32_t header_crc) noexcept;

}  // namespace loopwarden::record
