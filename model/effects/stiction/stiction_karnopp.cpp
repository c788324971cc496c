// SPDX-License-Identifier: Apache-2.0
#include "model/effects/stiction/stiction_karnopp.hpp"

#include <algorithm>
#include <cmath>

namespace loopwarden::effects {
namespace {
constexpr double kMass = 1.36;              // kg
constexpr double kSpringRate = 52'500.0;    // N/m
constexpr double kViscousFriction = 612.0;  // N s/m
constexpr double kSubstep = 0.5e-3;         // s, longest
constexpr int kMostSubsteps = 20'000;       // 10 s: in a longer period all motion has ended by then
constexpr double kRestVelocity = 1e-4;      // CO units/s
constexpr double kInverseMass = kSpringRate / kMass;         // 1/s^2, wn^2
constexpr double kDamping = kViscousFriction / kSpringRate;  // s
}  // namespace

StictionKarnopp::StictionKarnopp(StictionParameters parameters, double period_s) noexcept
    : full_(parameters),
      substeps_(static_cast<int>(
          std::clamp(std::ceil(period_s / kSubstep), 1.0, static_cast<double>(kMostSubsteps)))),
      substep_s_(std::min(period_s / substeps_, kSubstep)) {
  set_severity(1.0);
}

void StictionKarnopp::set_severity(double severity) noexcept {
  const StictionParameters now{full_.s * severity, full_.j * severity};
  static_friction_ = now.static_friction();
  moving_friction_ = now.moving_friction();
}

double StictionKarnopp::reset(double u) noexcept {
  last_u_ = u;
  x_ = u;
  v_ = 0.0;
  return x_;
}

double StictionKarnopp::step(double u) noexcept {
  if (!std::isfinite(u)) return x_;
  if (static_friction_ <= 0.0) return reset(u);
  // Semi-implicit in velocity: the viscous term is stiff.
  const double denominator = 1.0 + kInverseMass * kDamping * substep_s_;
  const double from = last_u_;
  const double rise = (u - from) / substeps_;
  last_u_ = u;
  for (int i = 1; i <= substeps_; ++i) {
    const double force = from + rise * i - x_;
    if (std::abs(v_) < kRestVelocity) {
      v_ = 0.0;
      if (std::abs(force) <= static_friction_) {
        if (std::abs(u - x_) <= static_friction_) return x_;  // stuck until the end of the period
        continue;
      }
    }
    const double direction = v_ != 0.0 ? v_ : force;
    const double net = force - std::copysign(moving_friction_, direction);
    const double before = v_;
    v_ = (v_ + kInverseMass * net * substep_s_) / denominator;
    // stopped within the substep; friction can't reverse the motion
    if (before * v_ < 0.0) v_ = 0.0;
    x_ += v_ * substep_s_;
  }
  return x_;
}

}  // namespace loopwarden::effects
