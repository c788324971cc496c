// SPDX-License-Identifier: Apache-2.0
#include "model/analysis/condition_index.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>

#include "model/analysis/limits.hpp"

namespace loopwarden::analysis {
namespace {

double index_of(std::initializer_list<double> shares_of_limit) noexcept {
  double worst = ConditionInputs::kUnknown;
  for (const double share : shares_of_limit) {
    if (std::isfinite(share)) worst = std::isfinite(worst) ? std::max(worst, share) : share;
  }
  return std::isfinite(worst) ? 100.0 * std::clamp(1.0 - worst, 0.0, 1.0) : worst;
}

}  // namespace

ConditionIndices condition_indices(const ConditionInputs& in) noexcept {
  return {.control_performance = index_of({in.rms_error_percent / Limits::kPerformanceLimit}),
          .valve = index_of({in.stick_percent / Limits::kStickLimit}),
          .actuator = index_of({in.stem_lag_s / Limits::kStemLagLimit, in.actuator_alarm}),
          .positioner = index_of({in.stem_deviation_percent / Limits::kDeviationLimit,
                                  in.read_back_bad_share / Limits::kBadShareLimit}),
          .environment = index_of({in.pv_bad_share / Limits::kBadShareLimit,
                                   in.cycle_bad_share / Limits::kCycleLimit})};
}

}  // namespace loopwarden::analysis
