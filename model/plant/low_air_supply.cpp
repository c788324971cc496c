// SPDX-License-Identifier: Apache-2.0
#include "model/plant/low_air_supply.hpp"

#include <algorithm>
#include <cmath>

namespace loopwarden::plant {

LowAirSupply::LowAirSupply(Parameters parameters, double period_s) noexcept
    : full_(parameters), period_s_(period_s) {
  set_severity(1.0);
}

void LowAirSupply::set_severity(double severity) noexcept {
  severity_ = severity;
  rate_ = full_.rate / severity;  // infinite at severity 0
  lag_s_ = full_.lag_s * severity;
}

double LowAirSupply::limited(double u) const noexcept {
  if (full_.preload > 0.0) u = std::max(u - severity_ * full_.preload, std::min(u, full_.shut));
  return u > full_.travel_limit ? u + severity_ * (full_.travel_limit - u) : u;
}

double LowAirSupply::reset(double u) noexcept { return x_ = limited(u); }

double LowAirSupply::step(double u) noexcept {
  const double distance = limited(u) - x_;
  const double size = std::abs(distance);
  const bool rate_applies = distance > 0.0 || full_.filling == Filling::both_ways;

  double remaining_s = period_s_;
  double left = size;  // CO units still to go
  const double exponential_below = rate_ * lag_s_;
  if (rate_applies && left > exponential_below) {
    const double until_exponential_s = (left - exponential_below) / rate_;
    const double at_rate_s = std::min(until_exponential_s, remaining_s);
    left -= rate_ * at_rate_s;
    remaining_s -= at_rate_s;
  }
  if (remaining_s > 0.0) left *= lag_s_ > 0.0 ? std::exp(-remaining_s / lag_s_) : 0.0;
  x_ += std::copysign(size - left, distance);
  return x_;
}

}  // namespace loopwarden::plant
