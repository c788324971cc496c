// SPDX-License-Identifier: Apache-2.0
#include "services/page/history/decimator.hpp"

#include <cmath>
#include <limits>
#include <utility>

namespace loopwarden::page::history {

namespace {

// Length of a gap that leaves a whole bucket empty, so that the gap's row takes its place.
constexpr double kGapBuckets = 2.0;

float first(const Extremes& e) { return e.first; }
float earlier(const Extremes& e) { return e.low_first ? e.low : e.high; }
float later(const Extremes& e) { return e.low_first ? e.high : e.low; }
float last(const Extremes& e) { return e.last; }
float none(const Extremes&) { return std::numeric_limits<float>::quiet_NaN(); }

}  // namespace

void Decimator::put(std::int64_t t_ms, const Block& block, Pick pick, bool sample) {
  // Two rows within a millisecond are one on every screen, but both are kept.
  if (!curves_.t_ms.empty() && t_ms <= curves_.t_ms.back()) t_ms = curves_.t_ms.back() + 1;
  curves_.t_ms.push_back(t_ms);
  for (std::size_t i = 0; i < kColumns; ++i) {
    curves_.columns[i].push_back(pick(block.columns[i]));
  }
  curves_.mode.push_back(static_cast<std::int16_t>(block.mode));
  curves_.sample.push_back(sample ? 1 : 0);
}

void Decimator::put_gap(std::int64_t t_ms) {
  put(t_ms, Block{}, none, false);
  curves_.mode.back() = -1;
}

void Decimator::flush() {
  if (!bucket_) return;
  const Block& b = *bucket_;
  put(b.first_ms, b, first, true);
  if (b.rows < 2) return;
  const std::int64_t span_ms = b.last_ms - b.first_ms;
  if (b.rows > 2) {
    put(b.first_ms + span_ms / 3, b, earlier, false);
    put(b.first_ms + span_ms * 2 / 3, b, later, false);
  }
  put(b.last_ms, b, last, true);
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
