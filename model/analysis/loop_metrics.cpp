// SPDX-License-Identifier: Apache-2.0
#include "model/analysis/loop_metrics.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "model/numeric/loop_record.hpp"

namespace loopwarden::analysis {
namespace {

void measure_error(std::span<const double> sp, std::span<const double> pv, LoopMetrics& m) {
  double sum = 0.0;
  double sum_squares = 0.0;
  std::size_t count = 0;
  for (std::size_t k = 0; k < pv.size(); ++k) {
    const double e = sp[k] - pv[k];
    if (!std::isfinite(e)) continue;
    sum += e;
    sum_squares += e * e;
    ++count;
  }
  if (count == 0) return;
  const auto n = static_cast<double>(count);
  m.mean_error = sum / n;
  m.rms_error = std::sqrt(sum_squares / n);
}

void measure_swing(std::span<const double> pv, double sample_time_s, LoopMetrics& m) {
  std::vector<double> sorted = numeric::known(pv);
  if (sorted.size() < 2) return;
  const auto percentile = [&](double share) {
    const auto nth = sorted.begin() +
                     static_cast<std::ptrdiff_t>(share * static_cast<double>(sorted.size() - 1));
    std::nth_element(sorted.begin(), nth, sorted.end());
    return *nth;
  };
  const double low = percentile(0.05);
  const double high = percentile(0.95);
  m.amplitude = (high - low) / 2.0;
  const double middle = (high + low) / 2.0;
  const double hysteresis = m.amplitude / 3.0;

  bool armed = false;  // PV was below the band after the last upward crossing
  std::size_t first = 0;
  std::size_t last = 0;
  std::size_t crossings = 0;
  for (std::size_t k = 0; k < pv.size(); ++k) {
    if (pv[k] < middle - hysteresis) armed = true;
    if (armed && pv[k] > middle + hysteresis) {
      armed = false;
      if (crossings++ == 0) first = k;
      last = k;
    }
  }
  if (crossings >= 2) {
    m.period_s =
        static_cast<double>(last - first) * sample_time_s / static_cast<double>(crossings - 1);
  }
}

void measure_travel(std::span<const double> stem, double sample_time_s, double resolution,
                    LoopMetrics& m) {
  if (stem.size() < 2) return;
  double travel = 0.0;
  double rest = stem.front();
  int direction = 0;
  std::size_t reversals = 0;
  for (const double position : stem) {
    const double move = position - rest;
    if (!(std::abs(move) > resolution)) continue;
    const int now = move > 0.0 ? 1 : -1;
    if (direction != 0 && now != direction) ++reversals;
    direction = now;
    travel += std::abs(move);
    rest = position;
  }
  const double hours = static_cast<double>(stem.size()) * sample_time_s / 3600.0;
  m.travel_per_hour = travel / hours;
  m.reversals_per_hour = static_cast<double>(reversals) / hours;
}

}  // namespace

LoopMetrics loop_metrics(std::span<const double> sp, std::span<const double> pv,
                         std::span<const double> stem, double sample_time_s,
                         double stem_resolution) {
  LoopMetrics m;
  measure_error(sp, pv, m);
  measure_swing(pv, sample_time_s, m);
  measure_travel(stem, sample_time_s, stem_resolution, m);
  return m;
}

}  // namespace loopwarden::analysis
