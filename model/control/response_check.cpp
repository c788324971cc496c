// SPDX-License-Identifier: Apache-2.0
#include "model/control/response_check.hpp"

#include <cmath>

#include "model/control/planned_moves_limits.hpp"
#include "model/control/scalar.hpp"

namespace loopwarden::control {

using Limits = PlannedMovesLimits;

ResponseCheck::ResponseCheck(const PlannedMovesSettings& settings) noexcept
    : gain_(settings.gain),
      intensity_(settings.load),
      wait_s_(settings.dead_time_s + 3.0 * settings.time_constant_s),
      read_back_(settings.read_back) {}

void ResponseCheck::begin(double position, const DisturbanceEstimator& now) noexcept {
  from_ = position;
  disturbance_before_ = now.disturbance();
  variance_before_ = now.variance();
  due_ = false;
}

void ResponseCheck::begin_probe(const DisturbanceEstimator& now) noexcept {
  disturbance_before_ = now.disturbance();
}

Response ResponseCheck::judge(double position, const DisturbanceEstimator& now,
                              double rested_s) noexcept {
  due_ = false;
  const double expected = moved(position);
  const double change = now.disturbance() - disturbance_before_;
  const double doubt = variance_before_ + now.variance() + squared(intensity_) * rested_s;
  if (!(squared(expected) > Limits::kClearResponse * doubt)) return Response::too_small;
  if (!(std::abs(change + expected) < Limits::kMissingResponse * std::abs(expected))) {
    unanswered_ = 0;
    return Response::answered;
  }
  const std::uint32_t most = read_back_ ? Limits::kContradictions : Limits::kUnanswered;
  return slipped_ || ++unanswered_ >= most ? Response::contradicts : Response::missing;
}

}  // namespace loopwarden::control
