// SPDX-License-Identifier: Apache-2.0
#include "model/numeric/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>

namespace loopwarden::numeric {
namespace {

double central_moment(std::span<const double> x, int order) {
  if (x.empty()) return 0.0;
  const double m = mean(x);
  double sum = 0.0;
  for (const double v : x) sum += std::pow(v - m, order);
  return sum / static_cast<double>(x.size());
}

}  // namespace

double mean(std::span<const double> x) {
  return x.empty() ? 0.0 : std::accumulate(x.begin(), x.end(), 0.0) / static_cast<double>(x.size());
}

double variance(std::span<const double> x) {
  if (x.empty()) return 0.0;
  const double m = mean(x);
  double sum = 0.0;
  for (const double v : x) sum += (v - m) * (v - m);
  return sum / static_cast<double>(x.size());
}

double deviation(std::span<const double> x) { return std::sqrt(variance(x)); }

double rms(std::span<const double> x) {
  if (x.empty()) return 0.0;
  double sum = 0.0;
  for (const double v : x) sum += v * v;
  return std::sqrt(sum / static_cast<double>(x.size()));
}

double rms_apart(std::span<const double> x, std::span<const double> y) {
  double sum = 0.0;
  std::size_t count = 0;
  for (std::size_t k = 0; k < x.size(); ++k) {
    if (!std::isfinite(y[k])) continue;
    sum += (x[k] - y[k]) * (x[k] - y[k]);
    ++count;
  }
  return count > 0 ? std::sqrt(sum / static_cast<double>(count)) : 0.0;
}

double skewness(std::span<const double> x) {
  const double v = variance(x);
  return v > 0.0 ? central_moment(x, 3) / (v * std::sqrt(v)) : 0.0;
}

double kurtosis(std::span<const double> x) {
  const double v = variance(x);
  return v > 0.0 ? central_moment(x, 4) / (v * v) : 0.0;
}

double correlation(std::span<const double> x, std::span<const double> y) {
  const double mx = mean(x);
  const double my = mean(y);
  double xx = 0.0;
  double yy = 0.0;
  double xy = 0.0;
  for (std::size_t k = 0; k < x.size(); ++k) {
    xx += (x[k] - mx) * (x[k] - mx);
    yy += (y[k] - my) * (y[k] - my);
    xy += (x[k] - mx) * (y[k] - my);
  }
  return xx > 0.0 && yy > 0.0 ? xy / std::sqrt(xx * yy) : 0.0;
}

double quantile_in_place(std::span<double> x, double p) noexcept {
  if (x.empty()) return 0.0;
  const auto at = static_cast<std::ptrdiff_t>(p * static_cast<double>(x.size() - 1) + 0.5);
  std::nth_element(x.begin(), x.begin() + at, x.end());
  return x[static_cast<std::size_t>(at)];
}

double quantile(std::vector<double> x, double p) { return quantile_in_place(x, p); }

double median(std::vector<double> x) { return quantile_in_place(x, 0.5); }

Range range_of(std::span<const double> x) noexcept {
  Range range;
  bool any = false;
  for (const double v : x) {
    if (!std::isfinite(v)) continue;
    if (!any) range = {v, v};
    any = true;
    range = {std::min(range.low, v), std::max(range.high, v)};
  }
  return range;
}

Range wilson_interval(std::size_t hits, std::size_t of) noexcept {
  if (of == 0) return {0.0, 1.0};
  constexpr double z = 1.959963984540054;
  const auto n = static_cast<double>(of);
  const double p = static_cast<double>(hits) / n;
  const double scale = 1.0 + z * z / n;
  const double centre = (p + z * z / (2.0 * n)) / scale;
  const double half = z / scale * std::sqrt(p * (1.0 - p) / n + z * z / (4.0 * n * n));
  return {std::max(centre - half, 0.0), std::min(centre + half, 1.0)};
}

}  // namespace loopwarden::numeric
