// SPDX-License-Identifier: Apache-2.0
#include "model/control/set_point.hpp"

#include <algorithm>
#include <cmath>

namespace loopwarden::control {

SetPoint::SetPoint(const SetPointLimits& limits, double initial) noexcept
    : limits_(limits), target_(std::clamp(initial, limits.low, limits.high)), working_(target_) {}

void SetPoint::configure(const SetPointLimits& limits) noexcept {
  limits_ = limits;
  target_ = std::clamp(target_, limits_.low, limits_.high);
}

void SetPoint::request(double target) noexcept {
  if (std::isfinite(target)) target_ = std::clamp(target, limits_.low, limits_.high);
}

void SetPoint::restart_ramp(double from) noexcept {
  if (std::isfinite(from)) working_ = std::clamp(from, limits_.low, limits_.high);
}

double SetPoint::step(double period_s) noexcept {
  return working_ = std::clamp(target_, working_ - limits_.rate_down_per_s * period_s,
                               working_ + limits_.rate_up_per_s * period_s);
}

bool SetPoint::ramped() const noexcept {
  return std::isfinite(limits_.rate_up_per_s) || std::isfinite(limits_.rate_down_per_s);
}

}  // namespace loopwarden::control
