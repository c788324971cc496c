// SPDX-License-Identifier: Apache-2.0
#include "model/control/valve_friction.hpp"

#include <algorithm>
#include <cmath>

#include "model/control/planned_moves_limits.hpp"

namespace loopwarden::control {

using Limits = PlannedMovesLimits;

namespace {

double low_of(double low, double value) noexcept { return low > 0.0 ? low : value; }

}  // namespace

ValveFriction::ValveFriction(const PlannedMovesSettings& settings) noexcept
    : s_(settings.s),
      s_low_(settings.s_low),
      s_high_(settings.s_high),
      j_(settings.j),
      j_low_(settings.j_low),
      j_high_(settings.j_high) {
  const double breakaway = 0.5 * (s_ + j_);
  const double kinetic = 0.5 * (s_ - j_);
  directions_[0] = {.breakaway = -breakaway, .kinetic_offset = -kinetic};
  directions_[1] = {.breakaway = breakaway, .kinetic_offset = kinetic};
}

double ValveFriction::j() const noexcept {
  const double estimate = 0.5 * ((directions_[1].breakaway - directions_[1].kinetic_offset) +
                                 (directions_[0].kinetic_offset - directions_[0].breakaway));
  return std::clamp(estimate, Limits::kLowestFriction * low_of(j_low_, j_),
                    Limits::kHighestFriction * std::max(j_high_, j_));
}

double ValveFriction::s() const noexcept {
  const double estimate = 0.5 * ((directions_[1].breakaway - directions_[0].kinetic_offset) +
                                 (directions_[1].kinetic_offset - directions_[0].breakaway));
  return std::clamp(estimate, Limits::kLowestFriction * low_of(s_low_, s_),
                    Limits::kHighestFriction * std::max(s_high_, s_));
}

double ValveFriction::largest_jump(bool seen) const noexcept {
  return seen ? j() : force_ * std::max(j(), j_high_);
}

double ValveFriction::sure_breakaway(double direction, bool seen) const noexcept {
  const double estimate = std::abs(of(direction).breakaway - centre());
  if (seen) return estimate;
  return force_ * std::max(estimate, 0.5 * (std::max(s_, s_high_) + std::max(j_, j_high_)));
}

void ValveFriction::learn_slip(double direction, double breakaway, double kinetic_offset) noexcept {
  Direction& now = of(direction);
  now.weight = std::max(Limits::kLeastSlipWeight, now.weight / (1.0 + now.weight));
  now.breakaway += now.weight * (breakaway - now.breakaway);
  now.kinetic_offset += now.weight * (kinetic_offset - now.kinetic_offset);
}

void ValveFriction::learn_landing(double direction, double kinetic_offset) noexcept {
  Direction& now = of(direction);
  now.kinetic_offset += Limits::kKineticWeight * (kinetic_offset - now.kinetic_offset);
}

void ValveFriction::raise_force() noexcept {
  force_ = std::min(Limits::kMostForce, Limits::kForceStep * force_);
}

}  // namespace loopwarden::control
