// SPDX-License-Identifier: Apache-2.0
#include "services/page/history/decimator.hpp"

#include <cmath>
#include <limits>
#include <utility>

namespace loopwarden::page::history {

namespace {

// So long that a whole bucket is empty: then there are never more rows than two for each bucket.
constexpr double kGapBuckets = 2.0;

}  // namespace

void Decimator::put(std::int64_t t_ms, const Block& block, bool second) {
  // Two rows within a millisecond are one on every screen, but both are told.
  if (!curves_.t_ms.empty() && t_ms <= curves_.t_ms.back()) t_ms = curves_.t_ms.back() + 1;
  curves_.t_ms.push_back(t_ms);
  for (std::size_t i = 0; i < kColumns; ++i) {
    const Extremes& e = block.columns[i];
    curves_.columns[i].push_back(e.low_first != second ? e.low : e.high);
  }
  curves_.mode.push_back(block.mode);
}

void Decimator::put_gap(std::int64_t t_ms) {
  put(t_ms, Block{}, false);
  for (auto& column : curves_.columns) column.back() = std::numeric_limits<float>::quiet_NaN();
  curves_.mode.back() = -1;
}

void Decimator::flush() {
  if (!bucket_) return;
  const std::int64_t span_ms = bucket_->last_ms - bucket_->first_ms;
  put(bucket_->first_ms + span_ms / 4, *bucket_, false);
  if (bucket_->rows > 1) put(bucket_->first_ms + span_ms * 3 / 4, *bucket_, true);
}

void Decimator::add(const Block& block) {
  const bool every_row = bucket_ms_ <= 0.0;
  const std::int64_t number =
      every_row ? number_ + 1
                : static_cast<std::int64_t>(
                      std::floor(static_cast<double>(block.first_ms - from_ms_) / bucket_ms_));
  if (!bucket_) {
    bucket_ = block;
    number_ = number;
    return;
  }
  if (block.first_ms < bucket_->last_ms) return;
  const bool gap = gap_between(*bucket_, block);
  const auto silent_ms = static_cast<double>(block.first_ms - bucket_->last_ms);
  if (!every_row && number <= number_) {
    append(*bucket_, block);
    bucket_->run = block.run;
    return;
  }
  flush();
  if (gap && silent_ms >= kGapBuckets * bucket_ms_)
    put_gap((bucket_->last_ms + block.first_ms) / 2);
  bucket_ = block;
  number_ = number;
}

Curves Decimator::take() {
  flush();
  bucket_.reset();
  return std::move(curves_);
}

}  // namespace loopwarden::page::history
