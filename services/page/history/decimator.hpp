// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "services/page/history/block.hpp"

namespace loopwarden::page::history {

// Curves to draw: columns of equal length, with their times.
struct Curves {
  std::vector<std::int64_t> t_ms;                    // UTC, rising
  std::array<std::vector<float>, kColumns> columns;  // NaN: no value; all columns at a gap
  std::vector<std::int16_t> mode;                    // -1 at a gap
  std::vector<std::uint8_t> sample;                  // 1: the row's values were measured together
};

// Reduces many rows to few without changing the picture. Each bucket yields its first row, each
// column's extremes in their order of time at a third and two thirds of its span, and its last row.
// A gap of two buckets' width or more becomes one row without values.
inline constexpr std::size_t kRowsPerBucket = 4;

class Decimator {
 public:
  // `bucket_ms` 0: every row unchanged, and a row for each gap.
  Decimator(std::int64_t from_ms, double bucket_ms) : from_ms_(from_ms), bucket_ms_(bucket_ms) {}

  // Adds blocks in the order of time. A block that begins before the end of the last one (a clock
  // was set back) is left out. A block belongs to the bucket in which it begins.
  void add(const Block& block);
  Curves take();

 private:
  void flush();
  using Pick = float (*)(const Extremes&);
  void put(std::int64_t t_ms, const Block& block, Pick pick, bool sample);
  void put_gap(std::int64_t t_ms);

  std::int64_t from_ms_;
  double bucket_ms_;
  std::optional<Block> bucket_;
  std::int64_t number_ = 0;  // of the bucket
  Curves curves_;
};

}  // namespace loopwarden::page::history
