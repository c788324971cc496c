// SPDX-License-Identifier: Apache-2.0
#include "model/analysis/step_metrics.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace loopwarden::analysis {
namespace {

// Returns the first time, in samples, at which r reaches `level`.
double first_crossing(const std::vector<double>& r, double level) {
  for (std::size_t k = 0; k < r.size(); ++k) {
    if (r[k] < level) continue;
    if (k == 0) return 0.0;
    return static_cast<double>(k - 1) + (level - r[k - 1]) / (r[k] - r[k - 1]);
  }
  return StepMetrics::kNever;
}

double settling(const std::vector<double>& r, double band) {
  for (std::size_t k = r.size(); k-- > 0;) {
    if (std::abs(r[k] - 1.0) <= band) continue;
    return k + 1 == r.size() ? StepMetrics::kNever : static_cast<double>(k + 1);
  }
  return 0.0;
}

}  // namespace

StepMetrics step_metrics(std::span<const double> y, double before, double final_value,
                         double sample_time_s) {
  StepMetrics m;
  const double step = final_value - before;
  std::vector<double> r;
  for (const double value : y) {
    if (std::isfinite(value)) {
      r.push_back((value - before) / step);
    } else if (!r.empty()) {
      r.push_back(r.back());
    }
  }
  if (r.size() < 2 || !(std::abs(step) > 0.0)) return m;
  m.delay_s = first_crossing(r, 0.5) * sample_time_s;
  if (const double end = first_crossing(r, 0.9); std::isfinite(end)) {
    m.rise_10_90_s = (end - first_crossing(r, 0.1)) * sample_time_s;
  }
  const auto peak = std::max_element(r.begin(), r.end());
  if (*peak > 1.0) {
    m.overshoot = *peak - 1.0;
    m.peak_time_s = static_cast<double>(peak - r.begin()) * sample_time_s;
  }
  m.settling_2_s = settling(r, 0.02) * sample_time_s;
  m.settling_5_s = settling(r, 0.05) * sample_time_s;
  return m;
}

}  // namespace loopwarden::analysis
