// SPDX-License-Identifier: Apache-2.0
#include "model/control/move_sequence.hpp"

#include <algorithm>
#include <cmath>

#include "model/control/planned_moves_limits.hpp"
#include "model/control/scalar.hpp"

namespace loopwarden::control {

using Limits = PlannedMovesLimits;

MoveSequence::MoveSequence(const PlannedMovesSettings& settings, bool shadow,
                           double period_s) noexcept
    : period_s_(period_s),
      given_lag_s_(settings.actuator_lag_s),
      response_s_(settings.dead_time_s + settings.time_constant_s),
      actuator_s_(settings.actuator_lag_s > 0.0 || !settings.read_back || shadow
                      ? settings.actuator_lag_s
                      : Limits::kActuatorLag_s) {}

void MoveSequence::restart() noexcept {
  failed_ = 0;
  since_failure_s_ = Limits::kNever;
}

void MoveSequence::begin_acting(bool seen) noexcept {
  if (given_lag_s_ <= 0.0 && seen) actuator_s_ = Limits::kActuatorLag_s;
}

double MoveSequence::settle_s(double sample_s) const noexcept {
  return std::max(Limits::kSettleSamples * sample_s, Limits::kSettleLags * actuator_s_);
}

double MoveSequence::push(const LoopEstimator& loop) const noexcept {
  const double sample_s = loop.read_back().sample_s();
  const double time_s = std::max(
      {Limits::kPush_s, Limits::kPushSamples * sample_s, Limits::kSettleLags * actuator_s_});
  return std::min(loop.friction().s() / time_s, Limits::kPushRate * loop.limits().rate_per_s) *
         period_s_;
}

void MoveSequence::begin_stroke(double position, double to, double output,
                                const OutputLimits& limits, HeldOutput& held) noexcept {
  since_failure_s_ = Limits::kNever;
  from_ = position;
  to_ = to;
  pushed_ = 0.0;
  held.hold(output, limits);
  held.held_s = 0.0;
}

void MoveSequence::begin(const MovePlan& plan, double position, const OutputLimits& limits,
                         HeldOutput& held) noexcept {
  target_ = plan.target;
  begin_stroke(position, plan.first_target, plan.first_output, limits, held);
}

void MoveSequence::begin_second(const LoopEstimator& loop, HeldOutput& held) noexcept {
  const double position = loop.stem(true).position;
  const double direction = sign_of(target_ - position);
  begin_stroke(position, target_, target_ + loop.friction().kinetic_offset(direction),
               loop.limits(), held);
}

bool MoveSequence::waits_for_read_back(const LoopEstimator& loop, HeldOutput& held) const noexcept {
  if (!loop.seen() || !loop.lost()) return false;
  held.held_s -= period_s_;
  return true;
}

bool MoveSequence::stands(const LoopEstimator& loop, double samples, double held_s) noexcept {
  const double standing_s = loop.stem(true).standing_s;
  const double sample_s = loop.read_back().sample_s();
  const double took_s = held_s - standing_s;
  if (standing_s < std::max(samples * sample_s, Limits::kStandsTook * took_s)) return false;
  if (pushed_ <= 0.0) {
    actuator_s_ +=
        Limits::kLagWeight * (std::max(0.0, took_s - 2.0 * sample_s) / 4.0 - actuator_s_);
  }
  return true;
}

StrokeResult MoveSequence::step_first(const LoopEstimator& loop, HeldOutput& held) noexcept {
  if (waits_for_read_back(loop, held)) return StrokeResult::under_way;
  if (!loop.seen()) {
    const bool over = held.held_s >= std::max(period_s_, Limits::kSettleLags * actuator_s_);
    return over ? StrokeResult::arrived : StrokeResult::under_way;
  }
  const double direction = sign_of(to_ - from_);
  const double position = loop.stem(true).position;
  const double jump = loop.friction().j();
  if ((position - from_) * direction > Limits::kMoved * jump) {
    const bool far_enough =
        std::abs(target_ - position) > Limits::kDirect * loop.friction().largest_jump(true);
    const bool over =
        held.held_s > 0.0 ? stands(loop, Limits::kStandsFirst, held.held_s) : far_enough;
    return over ? StrokeResult::arrived : StrokeResult::under_way;
  }
  if (held.held_s < settle_s(loop.read_back().sample_s())) return StrokeResult::under_way;
  const double step = push(loop);
  pushed_ += step;
  if (pushed_ > loop.friction().s()) return StrokeResult::stem_stuck;
  held.hold(held.output + direction * step, loop.limits());
  return StrokeResult::under_way;
}

StrokeResult MoveSequence::step_last(const LoopEstimator& loop, HeldOutput& held) noexcept {
  if (waits_for_read_back(loop, held)) return StrokeResult::under_way;
  const double settle = settle_s(loop.read_back().sample_s());
  if (!loop.seen()) {
    return held.held_s < settle ? StrokeResult::under_way : StrokeResult::arrived;
  }
  const double direction = sign_of(to_ - from_);
  const double moved = (loop.stem(true).position - from_) * direction;
  if (moved > Limits::kMoved * std::abs(to_ - from_)) {
    const bool over = held.held_s > 0.0 && stands(loop, Limits::kStandsLast, held.held_s);
    return over ? StrokeResult::arrived : StrokeResult::under_way;
  }
  if (held.held_s < settle) return StrokeResult::under_way;
  const double step = push(loop);
  pushed_ += step;
  held.hold(held.output + direction * step, loop.limits());
  return pushed_ > loop.friction().s() ? StrokeResult::stem_stuck : StrokeResult::under_way;
}

bool MoveSequence::fail() noexcept {
  since_failure_s_ = 0.0;
  return ++failed_ >= Limits::kFailedStrokes;
}

bool MoveSequence::may_be_late() const noexcept {
  return since_failure_s_ < std::max(Limits::kLate_s, response_s_);
}

bool MoveSequence::moved_late(double position, double j) const noexcept {
  return may_be_late() && (position - from_) * sign_of(to_ - from_) > Limits::kMoved * j;
}

}  // namespace loopwarden::control
