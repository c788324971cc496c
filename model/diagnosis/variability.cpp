// SPDX-License-Identifier: Apache-2.0
#include "model/diagnosis/variability.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "model/diagnosis/limits.hpp"

namespace loopwarden::diagnosis {

double variability(std::span<const double> y, std::size_t dead_time) {
  constexpr std::size_t m = Limits::kVariabilityOrder;
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  const std::size_t b = std::max<std::size_t>(1, dead_time);
  if (y.size() < 10 * (b + m)) return kNone;
  double mean = 0.0;
  std::size_t known = 0;
  for (const double v : y) {
    if (!std::isfinite(v)) continue;
    mean += v;
    ++known;
  }
  if (known < 10 * (b + m)) return kNone;
  mean /= static_cast<double>(known);
  Eigen::Matrix<double, static_cast<int>(m), static_cast<int>(m)> normal;
  Eigen::Matrix<double, static_cast<int>(m), 1> right;
  Eigen::Matrix<double, static_cast<int>(m), 1> row;
  normal.setZero();
  right.setZero();
  double total = 0.0;
  std::size_t rows = 0;
  // A missing sample excludes the rows that include it.
  std::size_t whole_since = 0;
  for (std::size_t k = 0; k < y.size(); ++k) {
    if (!std::isfinite(y[k])) {
      whole_since = k + 1;
      continue;
    }
    if (k < whole_since + b + m - 1) continue;
    for (std::size_t i = 0; i < m; ++i) row[static_cast<Eigen::Index>(i)] = y[k - b - i] - mean;
    const double value = y[k] - mean;
    normal.selfadjointView<Eigen::Lower>().rankUpdate(row);
    right += value * row;
    total += value * value;
    ++rows;
  }
  if (rows < 5 * m || !(total > 0.0)) return kNone;
  normal.diagonal().array() += 1e-9 * normal.trace() / static_cast<double>(m) + 1e-300;
  const Eigen::Matrix<double, static_cast<int>(m), 1> a =
      normal.selfadjointView<Eigen::Lower>().ldlt().solve(right);
  const double explained = a.dot(right);
  const double index = explained / total;
  return std::isfinite(index) ? std::clamp(index, 0.0, 1.0) : kNone;
}

std::size_t dead_time_samples(std::span<const double> co, std::span<const double> pv,
                              std::size_t most) {
  const std::size_t n = std::min(co.size(), pv.size());
  most = std::min(most, n / 4);
  if (most < 2) return 1;
  std::vector<double> along(most + 1, 0.0);
  for (std::size_t lag = 0; lag <= most; ++lag) {
    for (std::size_t k = 1; k + lag < n; ++k) {
      const double product = (co[k] - co[k - 1]) * (pv[k + lag] - pv[k + lag - 1]);
      if (std::isfinite(product)) along[lag] += product;
    }
    along[lag] = std::abs(along[lag]);
  }
  const auto peak = std::max_element(along.begin() + 1, along.end());
  auto first = peak;
  while (first > along.begin() + 1 && *(first - 1) > 0.5 * *peak) --first;
  return static_cast<std::size_t>(first - along.begin());
}

}  // namespace loopwarden::diagnosis
