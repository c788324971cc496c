// SPDX-License-Identifier: Apache-2.0
#include "model/control/cycle_statistics.hpp"

#include <algorithm>
#include <cmath>

namespace loopwarden::control {

void CycleStatistics::restart() noexcept {
  flips_ = 0;
  side_ = 0;
  total_ = {};
  cycles_ = mean_square_ = spread_ = 0.0;
}

bool CycleStatistics::add_error(double error, double margin, double travel) noexcept {
  const int side = error > margin ? 1 : error < -margin ? -1 : 0;
  bool ended = false;
  if (side != 0 && side != side_) {
    ended = side_ != 0 && ++flips_ % 2 == 1;
    if (ended) end_cycle(travel);
    side_ = side;
  }
  return ended;
}

void CycleStatistics::add_square(double error, bool counts) noexcept {
  running_.lasts_s += period_s_;
  if (!counts) return;
  running_.squares += error * error * period_s_;
  running_.counted_s += period_s_;
}

void CycleStatistics::end_cycle(double travel) noexcept {
  if (flips_ > 1 && running_.counted_s > 0.5 * running_.lasts_s) {
    cycles_ += 1.0;
    const double mean = running_.squares / running_.counted_s;
    const double difference = mean - mean_square_;
    mean_square_ += difference / cycles_;
    spread_ += difference * (mean - mean_square_);
    total_.squares += running_.squares;
    total_.counted_s += running_.counted_s;
    total_.lasts_s += running_.lasts_s;
    total_.travel += travel;
  }
  running_ = {};
}

double CycleStatistics::standard_error() const noexcept {
  return std::sqrt(spread_ / (cycles_ * std::max(1.0, cycles_ - 1.0)));
}

LoopBaseline CycleStatistics::baseline(double noise_variance, double j,
                                       double least_variance) const noexcept {
  return {.variance = std::max(total_.squares / total_.counted_s - noise_variance,
                               std::max(least_variance, 0.01 * noise_variance)),
          .travel_rate = std::max(total_.travel, j * cycles_) / total_.lasts_s,
          .cycle_s = total_.lasts_s / cycles_};
}

}  // namespace loopwarden::control
