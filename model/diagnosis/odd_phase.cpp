// SPDX-License-Identifier: Apache-2.0
#include "model/diagnosis/odd_phase.hpp"

#include <algorithm>
#include <cmath>

#include "model/numeric/statistics.hpp"

namespace loopwarden::diagnosis {

double odd_share(std::span<const double> pv, std::span<const double> co, double period) {
  if (pv.size() < 3) return 0.0;
  const double pv_mean = numeric::mean(pv);
  const double co_mean = numeric::mean(co);
  const std::size_t longest = std::min(static_cast<std::size_t>(period / 2.0 + 0.5), pv.size() - 2);
  double odd = 0.0;
  double even = 0.0;
  for (std::size_t lag = 0; lag <= longest; ++lag) {
    double pv_later = 0.0;
    double co_later = 0.0;
    for (std::size_t k = lag; k < pv.size(); ++k) {
      pv_later += (pv[k] - pv_mean) * (co[k - lag] - co_mean);
      co_later += (pv[k - lag] - pv_mean) * (co[k] - co_mean);
    }
    odd += (pv_later - co_later) * (pv_later - co_later);
    even += (pv_later + co_later) * (pv_later + co_later);
  }
  return odd + even > 0.0 ? odd / (odd + even) : 0.0;
}

double odd_phase_evidence(const TimeScales& pv, const TimeScales& co, double period) {
  double sum = 0.0;
  for (std::size_t i = 0; i < pv.size(); ++i) {
    const double odd = std::clamp(odd_share(pv[i], co[i], period), 0.01, 0.99);
    sum += std::log(odd / (1.0 - odd));
  }
  return sum / static_cast<double>(pv.size());
}

}  // namespace loopwarden::diagnosis
