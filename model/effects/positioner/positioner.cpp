// SPDX-License-Identifier: Apache-2.0
#include "model/effects/positioner/positioner.hpp"

#include <algorithm>
#include <cmath>

namespace loopwarden::effects {
namespace {
constexpr double kLongestSubstep = 0.025;  // s
constexpr double kMostServoSteps = 10'000.0;
constexpr double kShutShare = 0.002;  // share of the span
}  // namespace

Positioner::Positioner(const Parameters& parameters, double low, double high,
                       double period_s) noexcept
    : low_(low),
      high_(high),
      half_band_(parameters.dead_band / 2.0),
      breakaway_(parameters.breakaway),
      shut_below_(low + kShutShare * (high - low)) {
  const double longest_s = std::min(kLongestSubstep, 0.5 / parameters.gain_per_s);
  const double substeps = std::clamp(std::ceil(period_s / longest_s), 1.0, kMostServoSteps);
  const double substep_s = period_s / substeps;
  substeps_ = static_cast<int>(substeps);
  // If the substep is still too long at the largest count, z moves by at most dz(e) per substep.
  gain_substep_ = std::min(parameters.gain_per_s * substep_s, 1.0);
  approach_ = -std::expm1(-substep_s / parameters.lag_s);
}

double Positioner::reset(double u) noexcept {
  if (std::isfinite(u)) z_ = x_ = std::clamp(u, low_, high_);
  return u + severity_ * (x_ - u);
}

double Positioner::step(double u) noexcept {
  if (!std::isfinite(u)) return x_;
  for (int i = 0; i < substeps_; ++i) {
    const double e = u - x_;
    const bool held_shut = e < breakaway_ && x_ <= shut_below_ && z_ <= shut_below_;
    if (e < -half_band_ || (e > half_band_ && !held_shut)) {
      z_ = std::clamp(z_ + gain_substep_ * (e - std::copysign(half_band_, e)), low_, high_);
    }
    x_ += approach_ * (z_ - x_);
  }
  return u + severity_ * (x_ - u);
}

}  // namespace loopwarden::effects
