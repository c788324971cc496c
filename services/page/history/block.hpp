// SPDX-License-Identifier: Apache-2.0
// Consecutive rows, summarised by their ends and extremes. No files.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "record/record_row.hpp"

namespace loopwarden::page::history {

enum Column : std::size_t { kPv, kSp, kCo, kStem };
inline constexpr std::size_t kColumns = 4;

// One column of a block. NaN: no value in the first or last row, or in any row.
struct Extremes {
  float first;
  float low;
  float high;
  float last;
  bool low_first;  // the least value is before the greatest
};

struct Block {
  std::int64_t first_ms = 0;  // UTC
  std::int64_t last_ms = 0;
  std::uint64_t first_period = 0;
  std::uint64_t last_period = 0;
  std::uint64_t run = 0;        // of the daemon; periods count within one run
  std::uint32_t first_row = 0;  // places in its segment, including damaged rows
  std::uint32_t end_row = 0;    // after the last row
  std::uint32_t rows = 0;       // undamaged
  std::array<Extremes, kColumns> columns{};
  control::Mode mode = control::Mode::manual;  // of the last row
};

Block block_of(const record::RecordRow& row, std::int64_t utc_ms, std::uint64_t run,
               std::uint32_t index);

// Extends `block` by `later`, which must follow it.
void append(Block& block, const Block& later);

// Missing periods that the curve bridges: as many as the monitor's windows accept.
inline constexpr std::uint64_t kBridgedPeriods = 4;

// Returns whether rows are missing between the two, so that no line may join them.
constexpr bool gap_between(const Block& earlier, const Block& later) noexcept {
  return earlier.run != later.run || later.first_period <= earlier.last_period ||
         later.first_period - earlier.last_period > kBridgedPeriods + 1;
}

}  // namespace loopwarden::page::history
