// SPDX-License-Identifier: Apache-2.0
#include "model/analysis/condition_index.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>

namespace loopwarden::analysis {
namespace {

constexpr double kPerformanceLimit = 5.0;  // % of the PV range
constexpr double kStickLimit = 10.0;       // % of the CO range
constexpr double kLagLimit = 30.0;         // s
constexpr double kDeviationLimit = 3.0;    // % of the CO range
constexpr double kBadShareLimit = 0.1;
constexpr double kCycleLimit = 0.02;

double index_of(std::initializer_list<double> shares_of_limit) noexcept {
  double worst = ConditionInputs::kUnknown;
  for (const double share : shares_of_limit) {
    if (std::isfinite(share)) worst = std::isfinite(worst) ? std::max(worst, share) : share;
  }
  return std::isfinite(worst) ? 100.0 * std::clamp(1.0 - worst, 0.0, 1.0) : worst;
}

}  // namespace

ConditionIndices condition_indices(const ConditionInputs& in) noexcept {
  return {.control_performance = index_of({in.rms_error_percent / kPerformanceLimit}),
          .valve = index_of({in.stick_percent / kStickLimit}),
          .actuator = index_of({in.stem_lag_s / kLagLimit, in.actuator_alarm}),
          .positioner = index_of({in.stem_deviation_percent / kDeviationLimit,
                                  in.read_back_bad_share / kBadShareLimit}),
          .environment =
              index_of({in.pv_bad_share / kBadShareLimit, in.cycle_bad_share / kCycleLimit})};
}

}  // namespace loopwarden::analysis
