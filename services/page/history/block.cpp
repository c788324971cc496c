// SPDX-License-Identifier: Apache-2.0
#include "services/page/history/block.hpp"

#include <cmath>
#include <limits>

namespace loopwarden::page::history {
namespace {

Extremes one_value(double value) {
  const float narrow =
      std::isfinite(value) ? static_cast<float>(value) : std::numeric_limits<float>::quiet_NaN();
  return {narrow, narrow, narrow, narrow, true};
}

void take_extremes(Extremes& all, const Extremes& later) {
  all.low = later.low;
  all.high = later.high;
  all.low_first = later.low_first;
}

void append(Extremes& all, const Extremes& later) {
  all.last = later.last;
  if (std::isnan(later.low)) return;
  const bool low_is_later = std::isnan(all.low) || later.low < all.low;
  const bool high_is_later = std::isnan(all.high) || later.high > all.high;
  if (low_is_later && high_is_later) return take_extremes(all, later);
  if (low_is_later) {
    all.low = later.low;
    all.low_first = false;
  }
  if (high_is_later) {
    all.high = later.high;
    all.low_first = true;
  }
}

}  // namespace

Block block_of(const record::RecordRow& row, std::int64_t utc_ms, std::uint64_t run,
               std::uint32_t index) {
  Block block{.first_ms = utc_ms,
              .last_ms = utc_ms,
              .first_period = row.period_index,
              .last_period = row.period_index,
              .run = run,
              .first_row = index,
              .end_row = index + 1,
              .rows = 1};
  block.columns = {one_value(row.pv), one_value(row.sp), one_value(row.co), one_value(row.stem)};
  block.mode = row.mode;
  return block;
}

void append(Block& block, const Block& later) {
  block.last_ms = later.last_ms;
  block.last_period = later.last_period;
  block.end_row = later.end_row;
  block.rows += later.rows;
  for (std::size_t i = 0; i < kColumns; ++i) append(block.columns[i], later.columns[i]);
  block.mode = later.mode;
}

}  // namespace loopwarden::page::history
