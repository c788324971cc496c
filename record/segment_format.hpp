// SPDX-License-Identifier: Apache-2.0
// The format of a segment on the disk: a header of 512 bytes, then rows of 88, little-endian, each
// with a CRC-32 (IEEE 802.3). A row's CRC continues its header's CRC. A row of an older segment,
// left in the same place of the disk by a power failure, is therefore recognised as foreign.
//
// Version 2. Version 1 is still read. It had rows of 80 bytes, with one pair of columns for jacket
// and compensator. The pair belongs to the jacket if the row has a form of it, otherwise to the
// compensator. A loop with both, which needed one of them in shadow, can't be distinguished from
// one with a jacket.
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
  std::uint64_t sequence = 0;           // number of the segment of a loop
  std::uint64_t run = 0;                // sequence of the first segment since the daemon's start
  std::string loop{};                   // at most 63 bytes are kept
  double period_s = 0.0;                // s
  std::int64_t start_utc_ns = 0;        // when the first row was taken
  std::int64_t start_monotonic_ns = 0;  // RecordRow::time_ns of the first row
};

// Returns the UTC of a row, ns, from the clock at the start of the segment.
constexpr std::int64_t utc_ns(const SegmentHeader& header, const RecordRow& row) noexcept {
  // Unsigned, because a damaged clock value must not overflow.
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(header.start_utc_ns) +
                                   static_cast<std::uint64_t>(row.time_ns) -
                                   static_cast<std::uint64_t>(header.start_monotonic_ns));
}

struct EncodedHeader {
  std::array<char, kSegmentHeaderBytes> bytes;
  std::uint32_t crc;  // start value of the rows' CRCs
};
EncodedHeader encode(const SegmentHeader& header) noexcept;

struct DecodedHeader {
  SegmentHeader header;
  std::uint32_t crc = 0;
  std::size_t row_bytes = kSegmentRowBytes;  // of this segment's version
  const char* problem = nullptr;             // null: the header is valid
};
DecodedHeader decode_header(std::span<const char> bytes);

// `bytes` has the size kSegmentRowBytes.
void encode(const RecordRow& row, std::uint32_t index, std::uint32_t header_crc,
            std::span<char> bytes) noexcept;
// `bytes` has the size of a row given by the header. Returns nullopt if it is not the undamaged row
// `index` of the segment, or if an enumeration has an unknown value.
std::optional<RecordRow> decode_row(std::span<const char> bytes, std::uint32_t index,
                                    std::uint32_t header_crc) noexcept;

}  // namespace loopwarden::record
