// SPDX-License-Identifier: Apache-2.0
#include "model/diagnosis/hold_evidence.hpp"

#include <algorithm>
#include <cmath>

#include "model/diagnosis/series_ops.hpp"
#include "model/numeric/statistics.hpp"

namespace loopwarden::diagnosis {
namespace {

constexpr double kPartOfPeriod = 1.0 / 14.0;
constexpr double kWord = 0.5;  // of the deviation of the changes

Series changes(std::span<const double> x, std::size_t lag) {
  const Series smooth = medians_of_three(x);
  Series d(smooth.size() - lag);
  for (std::size_t k = 0; k < d.size(); ++k) d[k] = smooth[k + lag] - smooth[k];
  return d;
}

}  // namespace

double hold_evidence(std::span<const double> pv, std::span<const double> co, double period) {
  const auto lag = std::max<std::size_t>(1, static_cast<std::size_t>(kPartOfPeriod * period + 0.5));
  if (pv.size() <= 2 * lag) return 0.0;
  const Series dy = changes(pv, lag);
  const Series du = changes(co, lag);
  const double still = kWord * numeric::deviation(dy);
  const double moves = kWord * numeric::deviation(du);
  std::size_t moving = 0;
  std::size_t standing = 0;
  for (std::size_t k = 0; k < du.size(); ++k) {
    if (std::abs(du[k]) <= moves) continue;
    ++moving;
    if (std::abs(dy[k]) < still) ++standing;
  }
  return moving == 0 ? 0.0 : static_cast<double>(standing) / static_cast<double>(moving);
}

}  // namespace loopwarden::diagnosis
