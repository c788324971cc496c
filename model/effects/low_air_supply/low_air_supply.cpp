// SPDX-License-Identifier: Apache-2.0
#include "model/effects/low_air_supply/low_air_supply.hpp"

#include <algorithm>

namespace loopwarden::effects {

LowAirSupply::LowAirSupply(Parameters parameters, double period_s) noexcept
    : full_(parameters), period_s_(period_s), law_(at(1.0, 0.0)) {}

LowAirLaw<double> LowAirSupply::at(double severity, double x) const noexcept {
  return {{.limit = full_.travel_limit,
           .share = severity,
           .rate = full_.rate / severity,  // infinite at severity 0
           .lag_s = full_.lag_s * severity,
           .one_sided = full_.filling == Filling::one_sided,
           .closing = full_.closing},
          period_s_,
          x};
}

void LowAirSupply::set_severity(double severity) noexcept {
  severity_ = severity;
  law_ = at(severity, law_.x);
}

double LowAirSupply::beyond_spring(double u) const noexcept {
  if (!(full_.preload > 0.0)) return u;
  return std::max(u - severity_ * full_.preload, std::min(u, full_.shut));
}

double LowAirSupply::reset(double u) noexcept { return law_.x = law_.reached(beyond_spring(u)); }

double LowAirSupply::step(double u) noexcept { return law_.step(beyond_spring(u)); }

}  // namespace loopwarden::effects
