// SPDX-License-Identifier: Apache-2.0
#include "model/effects/stiction/stiction_inertial.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace loopwarden::effects {
namespace {

constexpr int kMostStops = 16;  // per period; more stops would be chatter by rounding errors

}  // namespace

StictionInertial::StictionInertial(StictionParameters parameters, Actuator actuator,
                                   double period_s, Travel travel) noexcept
    : full_(parameters),
      travel_(travel),
      period_s_(period_s),
      decay_rate_(actuator.damping * actuator.natural_frequency_rad_s),
      overdamped_(actuator.damping >= 1.0),
      // Exactly at 1 the solution has another form; very near 1 it has the same values.
      frequency_(actuator.natural_frequency_rad_s *
                 std::sqrt(std::max(std::abs(1.0 - actuator.damping * actuator.damping), 1e-6))),
      stiffness_(actuator.natural_frequency_rad_s * actuator.natural_frequency_rad_s) {
  const auto [c, s] = solution(period_s);
  xx_ = c + decay_rate_ * s;
  xv_ = s;
  vx_ = -stiffness_ * s;
  vv_ = c - decay_rate_ * s;
  set_severity(1.0);
}

void StictionInertial::set_severity(double severity) noexcept {
  const StictionParameters now{full_.s * severity, full_.j * severity};
  static_friction_ = now.static_friction();
  moving_friction_ = now.moving_friction();
  absent_ = severity <= 0.0;
}

double StictionInertial::reset(double u) noexcept {
  v_ = 0.0;
  return x_ = travel_.within(u);
}

double StictionInertial::stop_at_end() noexcept { return reset(x_); }

StictionInertial::Solution StictionInertial::solution(double time_s) const noexcept {
  if (overdamped_) {
    const double slow = std::exp((frequency_ - decay_rate_) * time_s);
    const double fast = std::exp((-frequency_ - decay_rate_) * time_s);
    return {0.5 * (slow + fast), 0.5 * (slow - fast) / frequency_};
  }
  const double decay = std::exp(-decay_rate_ * time_s);
  return {decay * std::cos(frequency_ * time_s),
          decay * std::sin(frequency_ * time_s) / frequency_};
}

void StictionInertial::advance(double centre, double time_s) noexcept {
  const auto [c, s] = solution(time_s);
  const double y = x_ - centre;
  x_ = centre + (c + decay_rate_ * s) * y + s * v_;
  v_ = -stiffness_ * s * y + (c - decay_rate_ * s) * v_;
}

void StictionInertial::start_or_stop(double u) noexcept {
  if (!std::isfinite(u)) return;
  if (absent_) {
    reset(u);
    return;
  }
  double left_s = period_s_;
  for (int stops = 0; stops < kMostStops && left_s > 0.0; ++stops) {
    if (v_ == 0.0 && std::abs(u - x_) <= static_friction_) break;
    const double direction = v_ != 0.0 ? std::copysign(1.0, v_) : std::copysign(1.0, u - x_);
    const double centre = u - direction * moving_friction_;
    const double y = x_ - centre;
    if (stops == 0) {
      const double v = vx_ * y + vv_ * v_;
      if (v * direction > 0.0) {
        x_ = centre + xx_ * y + xv_ * v_;
        v_ = v;
        break;
      }
    }
    double across = v_ * frequency_;
    double along = stiffness_ * y + decay_rate_ * v_;
    if (overdamped_) {
      // The velocity crosses zero at most once.
      const double ratio = across / along;
      const double stop_s = ratio > 0.0 && ratio < 1.0 ? std::atanh(ratio) / frequency_ : left_s;
      advance(centre, std::min(stop_s, left_s));
      if (stop_s >= left_s) break;
      v_ = 0.0;
      left_s -= stop_s;
      continue;
    }
    // The velocity next crosses zero at the phase of (along, across), or half a turn later.
    double stop_s = std::atan2(across, along) / frequency_;
    if (stop_s <= 1e-9) {
      stop_s += std::numbers::pi / frequency_;
      across = -across;
      along = -along;
    }
    if (stop_s >= left_s) {
      advance(centre, left_s);
      break;
    }
    const double swing = y * along + (v_ + decay_rate_ * y) / frequency_ * across;
    x_ = centre +
         std::exp(-decay_rate_ * stop_s) * swing / std::sqrt(along * along + across * across);
    v_ = 0.0;
    left_s -= stop_s;
  }
}

}  // namespace loopwarden::effects
