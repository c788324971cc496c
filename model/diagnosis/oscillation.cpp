// SPDX-License-Identifier: Apache-2.0
#include "model/diagnosis/oscillation.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "model/diagnosis/limits.hpp"
#include "model/diagnosis/series_ops.hpp"
#include "model/numeric/statistics.hpp"

namespace loopwarden::diagnosis {
namespace {

// The autocorrelation, computed lag by lag on demand: an oscillation needs only a few periods.
class Autocorrelation {
 public:
  explicit Autocorrelation(std::span<const double> x) : centred_(x.begin(), x.end()) {
    const double m = numeric::mean(x);
    for (double& v : centred_) v -= m;
    power_ = sum_at(0);
  }
  double at(std::size_t lag) const { return power_ > 0.0 ? sum_at(lag) / power_ : 0.0; }

 private:
  double sum_at(std::size_t lag) const {
    return dot(centred_.data() + lag, centred_.data(), centred_.size() - lag);
  }
  Series centred_;
  double power_ = 0.0;
};

// Returns the lags at which the autocorrelation crosses zero, interpolated between samples.
Series crossings_of(const Autocorrelation& acf, std::size_t max_lag) {
  Series crossings;
  double side = 1.0;
  double last = 0.0;
  bool has_last = false;
  double before = 1.0;
  for (std::size_t lag = 1; lag <= max_lag && crossings.size() <= Limits::kMostIntervals; ++lag) {
    const double now = acf.at(lag);
    if (before * side > 0.0 && now * side <= 0.0) {
      last = static_cast<double>(lag) - now / (now - before);
      has_last = true;
    }
    if (has_last && now * side < -Limits::kCrossingDepth) {
      crossings.push_back(last);
      side = -side;
      has_last = false;
    }
    before = now;
  }
  return crossings;
}

}  // namespace

Oscillation find_oscillation(std::span<const double> x) {
  Oscillation result;
  const Autocorrelation acf(x);
  const std::size_t max_lag = x.size() / 2;
  const Series crossings = crossings_of(acf, max_lag);
  if (crossings.empty()) return result;
  Series intervals;
  for (std::size_t k = 1; k < crossings.size(); ++k) {
    intervals.push_back(crossings[k] - crossings[k - 1]);
  }
  result.intervals = intervals.size();
  result.period = intervals.size() >= 3 ? 2.0 * numeric::mean(intervals) : 4.0 * crossings.front();
  if (intervals.size() >= 3) {
    const double spread = numeric::deviation(intervals);
    const double average = numeric::mean(intervals);
    result.regularity =
        std::min(Limits::kHighestRegularity, average / std::max(3.0 * spread, 1e-6 * average));
  }
  const auto lag = static_cast<std::size_t>(result.period + 0.5);
  if (lag > max_lag) return result;
  result.peak = -1.0;
  for (std::size_t k = lag - lag / 4; k <= std::min(max_lag, lag + lag / 4); ++k) {
    result.peak = std::max(result.peak, acf.at(k));
  }
  return result;
}

TimeScale find_time_scale(std::span<const double> x) {
  constexpr std::array<std::size_t, 4> kLengths{1, 3, 8, 20};
  TimeScale best;
  const Series straight = detrended(x);
  const double whole = numeric::variance(straight);
  if (whole <= 0.0) return best;
  for (const std::size_t part : kLengths) {
    const Series fast = part == 1 ? straight : high_passed(straight, x.size() / part);
    TimeScale scale;
    scale.oscillation = find_oscillation(fast);
    if (scale.oscillation.period < 3.0) continue;
    scale.score = (0.05 + std::min(Limits::kRegularityThatCounts, scale.oscillation.regularity)) *
                  std::sqrt(numeric::variance(fast) / whole);
    if (scale.score > best.score) best = scale;
  }
  return best;
}

}  // namespace loopwarden::diagnosis
