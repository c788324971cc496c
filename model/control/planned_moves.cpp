// SPDX-License-Identifier: Apache-2.0
#include "model/control/planned_moves.hpp"

#include <algorithm>
#include <cmath>

#include "model/control/planned_moves_limits.hpp"
#include "model/control/scalar.hpp"

namespace loopwarden::control {

using Limits = PlannedMovesLimits;

PlannedMoves::PlannedMoves(const PlannedMovesSettings& settings, bool shadow,
                           double period_s) noexcept
    : settings_(settings),
      period_s_(period_s),
      loop_(settings, shadow, period_s),
      cycles_(period_s),
      benefit_(period_s),
      planner_(settings),
      budget_(settings.max_moves_per_hour, period_s),
      probe_(settings, period_s),
      sequence_(settings, shadow, period_s),
      response_(settings) {}

void PlannedMoves::continue_hour(const PlannedMoves& before) noexcept {
  budget_.continue_hour(before.budget_, loop_.shadow());
}

void PlannedMoves::act() noexcept {
  if (!loop_.shadow()) return;
  loop_.begin_acting();
  budget_.begin_acting();
  sequence_.begin_acting(loop_.seen());
  disengagement_ = {};
  pending_ = {.engage = baseline_.variance > 0.0};
  phase_ = MovePhase::watching;
}

MovesRequest PlannedMoves::step(const MovesSample& sample) noexcept {
  const CompensatorInputs& in = sample.in;
  watch_.now_s += period_s_;
  loop_.observe(in, is_active(), phase_ == MovePhase::watching, held_.output);
  // A request takes effect some samples later.
  const bool in_effect = sample.held == held_.output;
  if (in_effect) {
    held_.pass(has_arrived(in.limits, held_.output, commanded(in), period_s_), period_s_);
  }
  planner_.pass(period_s_);
  probe_.pass();
  budget_.pass();
  if (is_active()) {
    sample.holding ? control(in, in_effect) : disengage(DisengageReason::interrupted);
  } else if (phase_ == MovePhase::disengaged) {
    watch_again();
  } else {
    await_hold(sample);
  }
  controller_before_ = in.output;
  if (is_active()) held_.hold(held_.output, in.limits);
  return request(in);
}

MovesRequest PlannedMoves::request(const CompensatorInputs& in) const noexcept {
  const double band = Limits::kBandErrors * std::sqrt(baseline_.variance) +
                      Limits::kBandNoise * std::sqrt(loop_.disturbance().noise_variance());
  const HoldAction idle = pending_.hold ? HoldAction::hold_here : HoldAction::release;
  return {.action = is_active() ? HoldAction::hold_at : idle,
          .output = held_.output,
          .pv_low = std::min(in.process_variable, in.set_point) - band,
          .pv_high = std::max(in.process_variable, in.set_point) + band,
          .disengaged =
              phase_ == MovePhase::disengaged ? disengagement_.reason : DisengageReason::none};
}

MovesState PlannedMoves::state() const noexcept {
  return {.phase = phase_,
          .reason = disengagement_.reason,
          .expected_offset = loop_.expected_offset(stem()),
          .action_threshold = planner_.action_threshold(loop_.disturbance().variance()),
          .output = held_.output,
          .gain = benefit_.gain(),
          .s = loop_.friction().s(),
          .j = loop_.friction().j(),
          .moves = moves_,
          .cycles_watched = static_cast<std::uint8_t>(std::min(cycles_.cycles(), 255.0)),
          .waits = phase_ == MovePhase::watching && (pending_.engage || pending_.resume),
          .latched = phase_ == MovePhase::disengaged && disengagement_.watch_at_s == Limits::kNever,
          .shadow = loop_.shadow()};
}

double PlannedMoves::settle_s() const noexcept {
  return sequence_.settle_s(loop_.read_back().sample_s());
}

// CO one period ago, in shadow that of the shadow loop.
double PlannedMoves::commanded(const CompensatorInputs& in) const noexcept {
  return loop_.shadow() ? loop_.shadow_output() : in.commanded;
}

PlanningState PlannedMoves::planning_state() const noexcept {
  return {.baseline = baseline_,
          .s = loop_.friction().s(),
          .j = loop_.friction().j(),
          .settle_s = settle_s(),
          .rate_per_s = loop_.limits().rate_per_s,
          .allowance = benefit_.remaining_excess(baseline_)};
}

// ---- under PI

void PlannedMoves::follow_set_point() noexcept {
  const double change = std::abs(loop_.set_point() - watch_.set_point);
  if (change <= loop_.margin(settings_.j)) return;
  watch_.set_point = loop_.set_point();
  const OutputLimits& limits = loop_.limits();
  const double distance =
      std::min(change / std::abs(settings_.gain), limits.high - limits.low) + loop_.friction().s();
  const double response_s = settings_.dead_time_s + settings_.time_constant_s;
  watch_.settled_at_s =
      watch_.now_s + settings_.dead_time_s + 2.0 * response_s + loop_.ramp_s(distance);
}

// Measures the loop until its cycles are known well enough to engage.
void PlannedMoves::watch() noexcept {
  follow_set_point();
  const double margin = loop_.margin(settings_.j);
  if (cycles_.add_error(loop_.error(), margin, stem().travel)) loop_.reset_travel();
  cycles_.add_square(loop_.error(), watch_.settled());
  const double cycles = cycles_.cycles();
  if (pending_.engage || pending_.resume || cycles < Limits::kLeastCyclesWatched || loop_.lost() ||
      !cycles_.cycle_has_just_ended()) {
    return;
  }
  // A read-back that could show slips but does not, while the loop cycles, is not trusted.
  const double j = loop_.friction().j();
  const bool shows_slips = cycles_.travel() > Limits::kVisibleTravel * j * cycles;
  if (loop_.seen() && !shows_slips && settings_.j > 2.0 * loop_.read_back().zone()) return;
  if (cycles < Limits::kMostCyclesWatched &&
      cycles_.standard_error() > Limits::kBaselineError * cycles_.mean_square()) {
    return;
  }
  baseline_ = cycles_.baseline(loop_.disturbance().noise_variance(), j,
                               squared(Limits::kLeastBaseline * settings_.gain * settings_.j));
  pending_.engage = true;
}

void PlannedMoves::watch_again() noexcept {
  if (watch_.now_s <= disengagement_.watch_at_s || loop_.lost()) return;
  phase_ = MovePhase::watching;
  cycles_.restart();
}

// CO is held during a probe: the offset of PV must not cost more than can be made good.
bool PlannedMoves::may_probe() const noexcept {
  const double offset = std::max(std::abs(loop_.expected_offset(stem())), std::abs(loop_.error()));
  const double probe_s =
      FrictionProbe::duration_s(settle_s(), loop_.read_back().sample_s(),
                                loop_.ramp_s(FrictionProbe::size(loop_.friction().s())));
  const double square = squared(offset) + Limits::kConfidence * loop_.disturbance().variance();
  return (square - baseline_.variance) * probe_s <
         Limits::kProbeCost * Limits::kExcess * baseline_.cycle_s * baseline_.variance;
}

// Under PI: has the controller hold CO when planned moves may begin, and begins once it does.
void PlannedMoves::await_hold(const MovesSample& sample) noexcept {
  const bool wanted = pending_.engage || (pending_.resume && budget_.allows(1.0));
  const bool may_begin = wanted && watch_.settled() && may_probe();
  if (may_begin && pending_.hold && sample.holding) return take_over(sample);
  // A hold of before must have ended.
  pending_.hold = may_begin && (pending_.hold || !sample.holding);
  watch();
}

void PlannedMoves::take_over(const MovesSample& sample) noexcept {
  const bool engages = pending_.engage;
  pending_ = {};
  held_.output = sample.held;
  loop_.take_over(sample.held);
  sequence_.take_over(loop_.read_back().stem().position);
  response_.take_over();
  planner_.follow(sample.in.set_point);
  engages ? engage() : resume();
}

void PlannedMoves::engage() noexcept {
  const double j = loop_.friction().j();
  benefit_.restart();
  response_.restart();
  sequence_.restart();
  probe_.forget_landings();
  budget_.restart(j);
  planner_.restart(j);
  moves_ = 0;
  disengagement_.reason = DisengageReason::none;
  if (!loop_.seen()) loop_.disturbance().set_variance(squared(settings_.gain * j));
  begin_probe();
}

void PlannedMoves::resume() noexcept {
  phase_ = MovePhase::resting;
  rested_s_ = 0.0;
}

void PlannedMoves::disengage(DisengageReason reason) noexcept {
  ++disengagement_.count;
  const bool latched =
      reason == DisengageReason::valve_follows || reason == DisengageReason::no_gain ||
      reason == DisengageReason::moved_late || disengagement_.count >= Limits::kDisengagements;
  phase_ = MovePhase::disengaged;
  disengagement_.reason = reason;
  disengagement_.watch_at_s =
      latched ? Limits::kNever : watch_.now_s + Limits::kRestCycles * baseline_.cycle_s;
}

// The controller follows the set point until a move is allowed and PV is to settle near it.
void PlannedMoves::hand_over() noexcept {
  phase_ = MovePhase::watching;
  pending_.resume = true;
}

// ---- under planned moves

// `in_effect`: CO follows the newest request. Otherwise only a new set point changes it.
void PlannedMoves::control(const CompensatorInputs& in, bool in_effect) noexcept {
  supervise();
  if (is_active() && !planner_.search(planning_state())) disengage(DisengageReason::no_gain);
  budget_.earn_travel(baseline_, loop_.friction().j());
  const bool new_set_point = planner_.is_new_set_point(in.set_point);
  if (is_active() && phase_ != MovePhase::resting && new_set_point) interrupt(in);
  if (!in_effect) return;
  switch (phase_) {
    case MovePhase::probing: probe(); break;
    case MovePhase::resting: rest(in); break;
    case MovePhase::backing_off: back_off(); break;
    case MovePhase::moving: move(in); break;
    case MovePhase::watching:
    case MovePhase::disengaged: break;
  }
}

void PlannedMoves::supervise() noexcept {
  const double response_s = settings_.dead_time_s + settings_.time_constant_s;
  const double lost_s = static_cast<double>(loop_.read_back().lost_samples()) * period_s_;
  if (settings_.read_back &&
      lost_s > std::max(Limits::kLostSamples * period_s_, Limits::kLostResponses * response_s)) {
    return disengage(DisengageReason::read_back_lost);
  }
  follow_set_point();
  if (!watch_.settled()) return;
  const DisengageReason reason =
      benefit_.add(loop_.error(), loop_.disturbance().noise_variance(), baseline_);
  if (reason != DisengageReason::none) disengage(reason);
}

// A new set point is followed at once, in a stroke or a probe as well.
void PlannedMoves::interrupt(const CompensatorInputs& in) noexcept {
  if (phase_ == MovePhase::probing) probe_.repeat();
  phase_ = MovePhase::resting;
  held_.output = commanded(in);
}

void PlannedMoves::begin_probe() noexcept {
  phase_ = MovePhase::probing;
  probe_.begin(loop_.limits(), held_);
  planner_.follow(loop_.set_point());
}

void PlannedMoves::probe() noexcept {
  if (loop_.shadow()) {
    phase_ = MovePhase::resting;
    return;
  }
  switch (probe_.step(loop_, settle_s(), response_.disturbance_before(), held_)) {
    case ProbeResult::under_way: return;
    case ProbeResult::pushed: return response_.begin_probe(loop_.disturbance());
    case ProbeResult::follows: return disengage(DisengageReason::valve_follows);
    case ProbeResult::sticks: break;
  }
  phase_ = MovePhase::resting;
  rested_s_ = settings_.dead_time_s + settings_.time_constant_s;
}

void PlannedMoves::rest(const CompensatorInputs& in) noexcept {
  rested_s_ += period_s_;
  sequence_.rest();
  if (sequence_.moved_late(stem().position, loop_.friction().j())) {
    return disengage(DisengageReason::moved_late);
  }
  if (loop_.seen() && stem().moved && rested_s_ > settle_s()) {
    rested_s_ = 0.0;
    response_.begin(stem().previous, loop_.disturbance());
    response_.slipped();
  }
  if (response_.due() && rested_s_ > response_.wait_s()) judge_response();
  if (phase_ != MovePhase::resting) return;
  const bool waits = sequence_.may_be_late() || (response_.has_slipped() && response_.due());
  if (!waits || planner_.is_new_set_point(in.set_point)) decide(in, waits);
}

// At rest: probes, plans a move, hands over to the controller, or stays. `waits`: only a new set
// point begins a move.
void PlannedMoves::decide(const CompensatorInputs& in, bool waits) noexcept {
  const bool new_set_point = planner_.is_new_set_point(in.set_point);
  const double response_s = settings_.dead_time_s + settings_.time_constant_s;
  const bool long_ago = loop_.seen() && !response_.due() &&
                        probe_.since_s() > Limits::kProbeCycles * baseline_.cycle_s;
  const bool doubtful = response_.has_slipped() || probe_.is_due() || long_ago;
  const double error = loop_.expected_offset(stem());
  const double overdrawn = budget_.travel() < 0.0 && !new_set_point ? budget_.travel() : 0.0;
  const double strain = 1.0 - overdrawn / (Limits::kStrainTravel * loop_.friction().j());
  const double threshold = planner_.action_threshold(loop_.disturbance().variance(), strain);
  const bool pays = std::abs(error) > threshold;
  if (doubtful && !waits && !(new_set_point && pays) && may_probe()) {
    response_.forget_slip();
    probe_.forget_landings();
    return begin_probe();
  }
  if (!pays || loop_.lost()) return;
  // At a new set point the controller is better if no move is long enough, or if its own first step
  // is longer than the move.
  const double distance = std::abs(error / settings_.gain);
  const bool controller_is_better = !budget_.allows(1.0) || distance > settings_.max_move ||
                                    std::abs(in.output - controller_before_) > distance;
  if (new_set_point && controller_is_better) return hand_over();
  const bool shown = rested_s_ > Limits::kShown * response_s + settle_s();
  if (!shown && !new_set_point) return;
  budget_.allows(1.0) ? plan(error) : hand_over();
}

void PlannedMoves::judge_response() noexcept {
  const Response response =
      response_.judge(loop_.read_back().stem().position, loop_.disturbance(), rested_s_);
  const bool missing = response == Response::missing || response == Response::contradicts;
  if (missing && !settings_.read_back) loop_.friction().raise_force();
  if (response == Response::contradicts) disengage(DisengageReason::contradiction);
}

void PlannedMoves::plan(double error) noexcept {
  const double position = stem().position;
  const MovePlan plan = planner_.plan(error, position, planning_state(), loop_.limits(),
                                      loop_.friction(), loop_.seen(), budget_.allows(2.0));
  if (!plan.possible) return;
  phase_ = plan.direct ? MovePhase::moving : MovePhase::backing_off;
  sequence_.begin(plan, position, loop_.limits(), held_);
  planner_.begin(error, loop_.set_point());
  response_.begin(position, loop_.disturbance());
  loop_.reset_travel();
  budget_.plan(plan.direct ? 1.0 : 2.0);
  budget_.count(loop_.shadow());
  probe_.count_move();
  ++moves_;
}

void PlannedMoves::back_off() noexcept {
  switch (sequence_.step_first(loop_, held_)) {
    case StrokeResult::under_way: return;
    case StrokeResult::stem_stuck: return fail_stroke();
    case StrokeResult::arrived: break;
  }
  budget_.count(loop_.shadow());
  phase_ = MovePhase::moving;
  sequence_.begin_second(loop_, held_);
}

void PlannedMoves::move(const CompensatorInputs& in) noexcept {
  switch (sequence_.step_last(loop_, held_)) {
    case StrokeResult::under_way: return;
    case StrokeResult::stem_stuck: return fail_stroke();
    case StrokeResult::arrived: return finish_move(in.applied);
  }
}

void PlannedMoves::fail_stroke() noexcept {
  if (sequence_.fail()) return disengage(DisengageReason::stem_stuck);
  phase_ = MovePhase::resting;
  rested_s_ = 0.0;
}

// The stroke to the target has ended; `applied`: CO, CO units.
void PlannedMoves::finish_move(double applied) noexcept {
  ValveFriction& friction = loop_.friction();
  const double position = stem().position;
  const double travel = stem().travel;
  phase_ = MovePhase::resting;
  rested_s_ = 0.0;
  sequence_.succeed();
  loop_.disturbance().add_gain_error(response_.moved(position));
  // Moves that follow the set point cost no travel.
  if (!planner_.follows_set_point() && watch_.settled()) {
    budget_.spend_travel(travel, friction.j());
  }
  response_.await(!loop_.shadow());
  if (!loop_.seen()) return;
  const double direction = sign_of(sequence_.to() - sequence_.from());
  const double landed = applied - position;
  const double expected = std::abs(friction.kinetic_offset(direction) - friction.centre());
  probe_.count_landing(std::abs(landed - friction.centre()) < Limits::kFreeLanding * expected &&
                       expected > Limits::kFreeZones * loop_.read_back().zone());
  planner_.learn_landing(sequence_.was_pushed() ? 0.0 : position - sequence_.to());
  friction.learn_landing(direction, landed);
}

}  // namespace loopwarden::control
