// SPDX-License-Identifier: Apache-2.0
#include "daemon/supervision/history.hpp"

#include <algorithm>
#include <limits>

namespace loopwarden::daemon::supervision {

History::History(double longest_s, double period_s)
    : period_s_(period_s),
      longest_gap_(static_cast<std::size_t>(kLongestGap_s / period_s)),
      rows_(std::clamp<std::size_t>(static_cast<std::size_t>(longest_s / period_s), 1, kMost)) {}

void History::put(double sp, double pv, double co) {
  rows_[next_] = {sp, pv, co};
  next_ = (next_ + 1) % rows_.size();
  count_ = std::min(count_ + 1, rows_.size());
}

void History::add(const watch::Cycle& cycle) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  const std::lock_guard lock(mutex_);
  const bool follows =
      cycle.period_index >= end_ && cycle.period_index - end_ <= longest_gap_ && count_ > 0;
  if (!cycle.automatic || !follows) {
    count_ = 0;
    quiet_ = cycle.period_index;
  } else {
    for (; end_ < cycle.period_index; ++end_) put(kNone, kNone, kNone);
  }
  end_ = cycle.period_index + 1;
  if (cycle.automatic) put(cycle.sp, cycle.pv_good ? cycle.pv : kNone, cycle.co);
}

void History::quiet() {
  const std::lock_guard lock(mutex_);
  quiet_ = end_;
}

History::Minutes History::minutes() const {
  const std::lock_guard lock(mutex_);
  Minutes out{{.period_s = period_s_}, end_};
  for (std::vector<double>* column : {&out.sp, &out.pv, &out.co}) column->reserve(count_);
  for (std::size_t i = 0; i < count_; ++i) {
    const Row& row = rows_[(next_ + rows_.size() - count_ + i) % rows_.size()];
    out.sp.push_back(row.sp);
    out.pv.push_back(row.pv);
    out.co.push_back(row.co);
  }
  return out;
}

std::uint64_t History::newest() const {
  const std::lock_guard lock(mutex_);
  return end_ > 0 ? end_ - 1 : 0;
}

double History::unquiet_s() const {
  const std::lock_guard lock(mutex_);
  const std::uint64_t cycles = end_ > quiet_ ? end_ - quiet_ : 0;
  return period_s_ * static_cast<double>(std::min<std::uint64_t>(cycles, count_));
}

}  // namespace loopwarden::daemon::supervision
