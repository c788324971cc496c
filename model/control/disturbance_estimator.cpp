// SPDX-License-Identifier: Apache-2.0
#include "model/control/disturbance_estimator.hpp"

#include <algorithm>
#include <cmath>

#include "model/control/planned_moves_limits.hpp"
#include "model/control/scalar.hpp"

namespace loopwarden::control {

using Limits = PlannedMovesLimits;

DisturbanceEstimator::DisturbanceEstimator(const PlannedMovesSettings& settings,
                                           double period_s) noexcept
    : gain_(settings.gain),
      s_(settings.s),
      period_s_(period_s),
      response_s_(settings.dead_time_s + settings.time_constant_s),
      process_(settings, period_s),
      variance_(squared(settings.gain * settings.s)) {
  const double least = Limits::kLeastIntensity * std::abs(settings.gain) * settings.j /
                       std::sqrt(std::max(response_s_, period_s));
  intensity_ = std::max(settings.load, least);
}

void DisturbanceEstimator::step(double process_variable, double stem) noexcept {
  if (!started_) {
    started_ = true;
    last_process_variable_ = process_variable;
    process_.reset(stem);
    disturbance_ = process_variable - process_.value();
  }
  const double change = process_variable - last_process_variable_;
  last_process_variable_ = process_variable;
  noise_variance_ += Limits::kPvNoiseWeight * (0.5 * squared(change) - noise_variance_);

  process_.step(stem);
  const double to_go = gain_ * stem - process_.value();
  const double samples = std::max(1.0, response_s_ / period_s_);
  const double unsure = squared(Limits::kModelError * to_go);
  variance_ += squared(intensity_) * period_s_;
  const double innovation = process_variable - process_.value() - disturbance_;
  const double weight = std::min(1.0, period_s_ / std::max(response_s_, period_s_));
  one_sided_ += weight * (innovation - one_sided_);
  const double expected = 0.5 * noise_variance_ * weight + variance_ + 4.0 * unsure;
  if (squared(one_sided_) > Limits::kOneSided * expected) variance_ += weight * squared(one_sided_);
  const double share =
      variance_ / (variance_ + noise_variance_ + Limits::kLeastDisturbance * squared(gain_ * s_) +
                   samples * unsure);
  disturbance_ += share * innovation;
  variance_ *= 1.0 - share;
}

void DisturbanceEstimator::add_gain_error(double moved) noexcept {
  variance_ += squared(Limits::kGainError * moved);
}

}  // namespace loopwarden::control
