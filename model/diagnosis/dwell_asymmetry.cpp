// SPDX-License-Identifier: Apache-2.0
#include "model/diagnosis/dwell_asymmetry.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "model/diagnosis/limits.hpp"
#include "model/diagnosis/series_ops.hpp"
#include "model/diagnosis/reversals.hpp"
#include "model/numeric/statistics.hpp"

namespace loopwarden::diagnosis {
namespace {

double scatter(const Series& x) {
  const double middle = numeric::median(x);
  if (x.size() < 4 || middle <= 0.0) return 1.0;
  return std::min(3.0, (numeric::quantile(x, 0.75) - numeric::quantile(x, 0.25)) / middle);
}

int word(double change, double threshold) {
  return change > threshold ? 1 : change < -threshold ? -1 : 0;
}

}  // namespace

DwellAsymmetry find_dwell_asymmetry(std::span<const double> output, std::span<const double> behind,
                                    double period) {
  DwellAsymmetry d;
  const auto smoothing = static_cast<std::size_t>(period / 40.0);
  const Series u = moving_mean(output, smoothing);
  const Series q = moving_mean(behind, smoothing);
  const auto reversals = turning_points(u, Limits::kDwellReversalDepth * numeric::deviation(u));
  Series by_output;
  Series by_behind;
  Series lateness;
  Series travels;
  Series durations;
  for (std::size_t i = 0; i + 1 < reversals.size(); ++i) {
    const std::size_t length = reversals[i + 1] - reversals[i];
    travels.push_back(std::abs(u[reversals[i + 1]] - u[reversals[i]]));
    durations.push_back(static_cast<double>(length));
    if (length < 4) continue;
    const auto part = std::max<std::size_t>(
        1, static_cast<std::size_t>(Limits::kPartOfRun * static_cast<double>(length)));
    // The answer is late, so the run of `behind` is shifted by up to a quarter of its length.
    const std::size_t end = std::min(q.size() - 1, reversals[i + 1] + length / 4);
    double output_step = 0.0;
    double behind_step = 0.0;
    std::size_t behind_at = reversals[i];
    double lowest = q[reversals[i]];
    double highest = lowest;
    for (std::size_t k = reversals[i]; k <= end; ++k) {
      lowest = std::min(lowest, q[k]);
      highest = std::max(highest, q[k]);
      if (k < reversals[i] + part) continue;
      if (k <= reversals[i + 1]) output_step = std::max(output_step, std::abs(u[k] - u[k - part]));
      if (std::abs(q[k] - q[k - part]) > behind_step) {
        behind_step = std::abs(q[k] - q[k - part]);
        behind_at = k - part / 2;
      }
    }
    const double range = std::abs(u[reversals[i + 1]] - u[reversals[i]]);
    if (range <= 0.0 || highest <= lowest) continue;
    by_output.push_back(output_step / range);
    by_behind.push_back(behind_step / (highest - lowest));
    lateness.push_back(static_cast<double>(behind_at - reversals[i]) / static_cast<double>(length));
  }
  d.travel_scatter = scatter(travels);
  d.duration_scatter = scatter(durations);
  d.runs = by_output.size();
  if (d.runs >= 2) {
    d.output_concentration = numeric::median(by_output);
    d.behind_concentration = numeric::median(by_behind);
    d.late = numeric::median(lateness);
  }

  const auto lag = std::max<std::size_t>(1, static_cast<std::size_t>(period / 10.0 + 0.5));
  if (u.size() <= 3 * lag) return d;
  Series moved_u;
  Series moved_q;
  for (std::size_t k = lag; k < u.size(); ++k) {
    moved_u.push_back(u[k] - u[k - lag]);
    moved_q.push_back(q[k] - q[k - lag]);
  }
  const double threshold_u = Limits::kSteadyWord * numeric::deviation(moved_u);
  const double threshold_q = Limits::kSteadyWord * numeric::deviation(moved_q);
  double moving = 0.0;
  double sticky = 0.0;
  double pairs = 0.0;
  for (std::size_t k = 0; k + lag < moved_u.size(); ++k) {
    const int by_u = word(moved_u[k], threshold_u);
    if (by_u == 0) continue;
    moving += 1.0;
    if (word(moved_q[k], threshold_q) != 0) continue;
    sticky += 1.0;
    const int next = word(moved_q[k + lag], threshold_q);
    if (next == 0) pairs += 0.5;
    if (next == by_u) pairs += 1.0;
  }
  if (moving > 0.0) {
    d.sticky_words = sticky / moving;
    d.sticky_pairs = pairs / moving;
  }
  d.heavy_tails = std::log2(std::max(numeric::kurtosis(moved_q), 1.0) / 3.0);
  d.output_tails = std::log2(std::max(numeric::kurtosis(moved_u), 1.0) / 3.0);
  double area = 0.0;
  for (std::size_t k = 1; k < u.size(); ++k) area += u[k - 1] * q[k] - u[k] * q[k - 1];
  const double spread = std::sqrt(numeric::variance(u) * numeric::variance(q));
  if (spread > 0.0) {
    d.loop_area = area * period / static_cast<double>(u.size()) / (4.0 * std::numbers::pi * spread);
  }
  return d;
}

}  // namespace loopwarden::diagnosis
