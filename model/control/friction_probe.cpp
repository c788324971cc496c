// SPDX-License-Identifier: Apache-2.0
#include "model/control/friction_probe.hpp"

#include <cmath>

#include "model/control/planned_moves_limits.hpp"
#include "model/control/scalar.hpp"

namespace loopwarden::control {

using Limits = PlannedMovesLimits;

FrictionProbe::FrictionProbe(const PlannedMovesSettings& settings, double period_s) noexcept
    : period_s_(period_s),
      gain_(settings.gain),
      unseen_wait_s_(settings.dead_time_s + 3.0 * settings.time_constant_s) {}

double FrictionProbe::size(double s) noexcept { return Limits::kProbe * s; }

double FrictionProbe::duration_s(double settle_s, double sample_s, double ramp_s) noexcept {
  return 2.0 * settle_s + Limits::kQuietSamples * sample_s + Limits::kProbeWait_s + ramp_s;
}

void FrictionProbe::begin(const OutputLimits& limits, HeldOutput& held) noexcept {
  held.hold(held.output, limits);
  held.held_s = 0.0;
  pushed_ = 0.0;
  followed_ = 0;
  moves_since_ = 0;
  since_s_ = 0.0;
}

void FrictionProbe::repeat() noexcept { free_landings_ = Limits::kFreeLandings; }

bool FrictionProbe::is_due() const noexcept {
  return free_landings_ >= Limits::kFreeLandings || moves_since_ >= Limits::kProbeMoves;
}

ProbeResult FrictionProbe::step(const LoopEstimator& loop, double settle_s,
                                double disturbance_before, HeldOutput& held) noexcept {
  const bool seen = loop.seen();
  if (pushed_ == 0.0) {
    // The stem first finishes the moves of the controller.
    const double quiet_s = settle_s + Limits::kQuietSamples * loop.read_back().sample_s();
    if (held.held_s < quiet_s || loop.lost()) return ProbeResult::under_way;
    held.held_s = 0.0;
    from_ = loop.stem(true).position;
    pushed_ =
        (held.output - from_ > loop.friction().centre() ? -1.0 : 1.0) * size(loop.friction().s());
    const double to = held.output + pushed_;
    if (to > loop.limits().high || to < loop.limits().low) pushed_ = -pushed_;
    held.output += pushed_;
    return ProbeResult::pushed;
  }
  if (followed_ > Limits::kProbeSamples) return ProbeResult::follows;
  if (seen && !loop.read_back().renewed()) return ProbeResult::under_way;
  const double wait_s = seen ? Limits::kProbeWait_s + settle_s : unseen_wait_s_;
  const double followed = seen ? loop.read_back().newest() - from_
                               : (loop.disturbance().disturbance() - disturbance_before) / gain_;
  const bool follows = followed * sign_of(pushed_) > Limits::kProbeFollows * std::abs(pushed_);
  followed_ = follows ? followed_ + 1 : 0;
  if (seen ? followed_ == Limits::kProbeSamples : follows && held.held_s >= wait_s) {
    held.output -= pushed_;  // the next period disengages
    followed_ = Limits::kProbeSamples + 1;
    return ProbeResult::under_way;
  }
  return held.held_s < wait_s ? ProbeResult::under_way : ProbeResult::sticks;
}

}  // namespace loopwarden::control
