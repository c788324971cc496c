// SPDX-License-Identifier: Apache-2.0
#include "model/effects/positioner_overshoot/positioner_overshoot.hpp"

#include <cmath>

namespace loopwarden::effects {

PositionerOvershoot::PositionerOvershoot(double damping, double natural_frequency_rad_s,
                                         double period_s, Travel travel) noexcept
    : travel_(travel) {
  const double decay_rate = damping * natural_frequency_rad_s;                            // 1/s
  const double frequency = natural_frequency_rad_s * std::sqrt(1.0 - damping * damping);  // rad/s
  const double decay = std::exp(-decay_rate * period_s);
  const double c = decay * std::cos(frequency * period_s);
  const double s = decay * std::sin(frequency * period_s) / frequency;
  xx_ = c + decay_rate * s;
  xv_ = s;
  vx_ = -natural_frequency_rad_s * natural_frequency_rad_s * s;
  vv_ = c - decay_rate * s;
}

double PositionerOvershoot::reset(double u) noexcept {
  x_ = travel_.within(u);
  v_ = 0.0;
  return x_;
}

double PositionerOvershoot::step(double u) noexcept {
  const double distance = x_ - u;
  x_ = u + xx_ * distance + xv_ * v_;
  v_ = vx_ * distance + vv_ * v_;
  if (travel_.beyond(x_)) {
    x_ = travel_.within(x_);
    v_ = 0.0;
  }
  return u + severity_ * (x_ - u);
}

}  // namespace loopwarden::effects
