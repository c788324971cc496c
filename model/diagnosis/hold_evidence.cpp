// SPDX-License-Identifier: Apache-2.0
#include "model/diagnosis/hold_evidence.hpp"

#include <algorithm>
#include <cmath>

#include "model/diagnosis/limits.hpp"
#include "model/diagnosis/series_ops.hpp"
#include "model/numeric/statistics.hpp"

namespace loopwarden::diagnosis {
namespace {

Series changes(std::span<const double> x, std::size_t lag) {
  const Series smooth = medians_of_three(x);
  Series d(smooth.size() - lag);
  for (std::size_t k = 0; k < d.size(); ++k) d[k] = smooth[k + lag] - smooth[k];
  return d;
}

}  // namespace

double hold_evidence(std::span<const double> pv, std::span<const double> co, double period) {
  const auto lag =
      std::max<std::size_t>(1, static_cast<std::size_t>(Limits::kPartOfPeriod * period + 0.5));
  if (pv.size() <= 2 * lag) return 0.0;
  const Series dy = changes(pv, lag);
  const Series du = changes(co, lag);
  const double still = Limits::kSteadyWord * numeric::deviation(dy);
  const double moves = Limits::kSteadyWord * numeric::deviation(du);
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
