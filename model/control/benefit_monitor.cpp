// SPDX-License-Identifier: Apache-2.0
#include "model/control/benefit_monitor.hpp"

#include <algorithm>
#include <cmath>

#include "model/control/planned_moves_limits.hpp"

namespace loopwarden::control {

using Limits = PlannedMovesLimits;

DisengageReason BenefitMonitor::add(double error, double noise_variance,
                                    const LoopBaseline& baseline) noexcept {
  const double square = error * error;
  window_squares_ += square * period_s_;
  window_s_ += period_s_;
  if (window_s_ >= Limits::kWindowCycles * baseline.cycle_s &&
      !end_window(noise_variance, baseline)) {
    return DisengageReason::no_gain;
  }
  const double excess =
      std::min(square - noise_variance, Limits::kLargestSquare * baseline.variance) -
      baseline.variance;
  excess_ = std::max(excess_ + excess * period_s_,
                     -Limits::kSaved * baseline.cycle_s * baseline.variance);
  return excess_ > Limits::kExcess * baseline.cycle_s * baseline.variance
             ? DisengageReason::error_too_large
             : DisengageReason::none;
}

// Returns whether the RMS is still low enough.
bool BenefitMonitor::end_window(double noise_variance, const LoopBaseline& baseline) noexcept {
  const double variance =
      std::max(1e-4 * baseline.variance, window_squares_ / window_s_ - noise_variance);
  ++windows_;
  const double weight = std::max(Limits::kWindowWeight, 1.0 / windows_);
  gain_ = std::sqrt(gain_ * gain_ + weight * (variance / baseline.variance - gain_ * gain_));
  window_squares_ = window_s_ = 0.0;
  return windows_ < Limits::kWindows || gain_ <= Limits::kLargestGain;
}

double BenefitMonitor::remaining_excess(const LoopBaseline& baseline) const noexcept {
  return Limits::kExcess * baseline.cycle_s * baseline.variance - std::max(0.0, excess_);
}

}  // namespace loopwarden::control
