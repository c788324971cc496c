// SPDX-License-Identifier: Apache-2.0
#include "model/control/stem_estimator.hpp"

#include <algorithm>
#include <cmath>

#include "model/control/planned_moves_limits.hpp"
#include "model/control/scalar.hpp"

namespace loopwarden::control {

using Limits = PlannedMovesLimits;

namespace {

std::size_t first_renewal(const PlannedMovesSettings& settings, double period_s) noexcept {
  if (!settings.read_back) return 1;
  return static_cast<std::size_t>(std::max(1.0, Limits::kReadBack_s / period_s));
}

}  // namespace

void Stem::move_to(double to) noexcept {
  travel += std::abs(to - position);
  previous = position;
  position = to;
  standing_s = 0.0;
  moved = true;
}

void StictionStem::step(double output, const ValveFriction& friction, double period_s) noexcept {
  if (!stem_.known) {
    stem_ = {.known = true, .position = output - friction.centre()};
    output_ = output;
  }
  stem_.moved = false;
  stem_.standing_s += period_s;
  const double change = output - output_;
  output_ = output;
  const double force = output - stem_.position;
  if (change * direction_ <= 0.0) direction_ = 0.0;
  if (force > friction.breakaway(1.0)) direction_ = 1.0;
  if (force < friction.breakaway(-1.0)) direction_ = -1.0;
  if (direction_ != 0.0) stem_.move_to(output - friction.kinetic_offset(direction_));
}

void StictionStem::begin(const StictionStem& before, double output) noexcept {
  *this = before;
  output_ = output;
}

bool ReadBackClock::step(bool changed) noexcept {
  ++since_renewal_;
  if (changed) {
    if (changed_before_) renewal_ = std::min(renewal_, since_change_ + 1);
    changed_before_ = true;
    since_change_ = 0;
  } else {
    ++since_change_;
  }
  const bool due = 2 * since_renewal_ + 1 >= 3 * renewal_;
  if (!changed && !due) return false;
  since_renewal_ = 0;
  return true;
}

StemEstimator::StemEstimator(const PlannedMovesSettings& settings, double period_s) noexcept
    : read_back_(settings.read_back),
      period_s_(period_s),
      s_(settings.s),
      j_(settings.j),
      clock_(first_renewal(settings, period_s)),
      variance_(squared(Limits::kReadBackNoise * settings.j)) {}

double StemEstimator::zone() const noexcept {
  const double step =
      least_step_ < Limits::kLargestStep * j_ ? Limits::kStepZone * least_step_ : 0.0;
  return std::max({Limits::kNoiseZone * std::sqrt(variance_), step, Limits::kLeastZone * s_});
}

void StemEstimator::step(const CompensatorInputs& in, bool learns,
                         ValveFriction& friction) noexcept {
  if (!read_back_) {
    model_.step(in.applied, friction, period_s_);
  } else if (in.valve_position_valid && std::isfinite(in.valve_position)) {
    lost_ = 0;
    read(in.valve_position, in.applied, learns, friction);
  } else {
    ++lost_;
    model_.stem().moved = false;
  }
}

void StemEstimator::read(double position, double output, bool learns,
                         ValveFriction& friction) noexcept {
  Stem& stem = model_.stem();
  if (!stem.known) {
    stem = {.known = true, .position = position, .previous = position};
    newest_ = position;
    averaged_ = 1.0;
  }
  stem.moved = false;
  stem.standing_s += period_s_;
  const double change = position - newest_;
  renewed_ = clock_.step(std::abs(change) > Limits::kNoChange * s_);
  if (!renewed_) return;
  const double zone_now = zone();
  if (std::abs(change) < Limits::kStepZone * zone_now) {
    variance_ += Limits::kReadBackNoiseWeight * (0.5 * squared(change) - variance_);
  }
  if (change != 0.0) least_step_ = std::min(least_step_, std::abs(change));
  away_ = std::abs(position - stem.position) > zone_now ? away_ + 1 : 0;
  if (away_ == 1) output_at_slip_ = output;
  if (away_ >= 2) {
    const bool stood = stem.standing_s >= Limits::kStoodSamples * sample_s();
    if (learns && stood && j_ > Limits::kSlipVisible * zone_now) {
      friction.learn_slip(position < stem.position ? -1.0 : 1.0, output_at_slip_ - stem.position,
                          output_at_slip_ - newest_);
    }
    stem.move_to(position);
    averaged_ = 1.0;
    away_ = 0;
  } else if (away_ == 0) {
    averaged_ = std::min(averaged_ + 1.0, Limits::kMostAveraged);
    stem.position += (position - stem.position) / averaged_;
  }
  newest_ = position;
}

}  // namespace loopwarden::control
