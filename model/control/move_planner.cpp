// SPDX-License-Identifier: Apache-2.0
#include "model/control/move_planner.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "model/control/planned_moves_limits.hpp"
#include "model/control/scalar.hpp"

namespace loopwarden::control {

using Limits = PlannedMovesLimits;

MovePlanner::MovePlanner(const PlannedMovesSettings& settings) noexcept
    : settings_(settings),
      landing_variance_(
          squared(Limits::kLandingError * settings.j +
                  Limits::kLandingInterval *
                      (settings.j_low > 0.0 ? settings.j_high - settings.j_low : 0.0))) {}

void MovePlanner::restart(double j) noexcept {
  candidate_ = 0;
  best_.cost = Limits::kNever;
  chosen_ = {.threshold = Limits::kFirstThreshold * std::abs(settings_.gain) * j};
}

double MovePlanner::action_threshold(double variance, double strain) const noexcept {
  return std::sqrt(squared(chosen_.threshold * strain) + Limits::kConfidence * variance);
}

bool MovePlanner::is_new_set_point(double set_point) const noexcept {
  return std::abs(set_point - planned_for_) > chosen_.threshold;
}

// Squared intensity of the disturbance: as given, and as the times between moves show it.
double MovePlanner::walk(double j) const noexcept {
  const double given =
      std::max(squared(settings_.load), Limits::kLeastWalk * squared(settings_.gain * j));
  const double room = Limits::kWalkThresholds * squared(chosen_.threshold);
  return (room + passed_room_) / (room / given + passed_s_);
}

// Squared error of a detour if PV settles off by `error`, PV units^2 s.
double MovePlanner::pulse(double detour, double error, const PlanningState& loop) const noexcept {
  const double away_s = 2.0 * loop.settle_s + (loop.s + detour) / loop.rate_per_s;
  const double lag_s = settings_.time_constant_s;
  const double filled_s = away_s + (lag_s > 0.0 ? lag_s * std::expm1(-away_s / lag_s) : 0.0);
  return squared(std::abs(settings_.gain) * detour + std::abs(error)) * filled_s;
}

bool MovePlanner::search(const PlanningState& loop) noexcept {
  const LoopBaseline& without = loop.baseline;
  const double gain = std::abs(settings_.gain);
  const double landing =
      std::max(gain * std::sqrt(landing_variance_), Limits::kLeastLanding * gain * loop.j);
  const double least = Limits::kLeastThreshold * landing;
  const double most = Limits::kLargestThreshold * std::sqrt(without.variance);
  if (most < least) return false;
  const double h =
      least * std::pow(most / least, static_cast<double>(candidate_) / (Limits::kThresholds - 1));
  const double walk = this->walk(loop.j);
  const double detour = Limits::kDetour * loop.j;
  const double pulse = this->pulse(detour, h, loop);
  const double response_s = settings_.dead_time_s + settings_.time_constant_s;
  for (const double share : Limits::kMargins) {
    const double m = share * h;
    const double room = squared(h) - squared(m);
    const double rate = 1.0 / (room / walk + Limits::kShown * response_s);
    const double distance = (h - m) / gain;
    const bool direct = distance >= Limits::kDirect * loop.j;
    if (!direct && (detour + distance > settings_.max_move || pulse > loop.allowance)) continue;
    const double travel = rate * (direct ? distance : distance + 2.0 * detour);
    const double variance = (squared(h) + squared(m)) / 6.0 + squared(landing) +
                            rate * ((settings_.dead_time_s + 0.5 * settings_.time_constant_s +
                                     0.5 * loop.s / loop.rate_per_s) *
                                        room +
                                    (direct ? 0.0 : pulse));
    const double over_travel = travel / (Limits::kTravel * without.travel_rate) - 1.0;
    const double over_moves = rate * 3600.0 / settings_.max_moves_per_hour - 1.0;
    const double cost = variance / without.variance +
                        Limits::kTravelCost * travel / without.travel_rate +
                        Limits::kBudgetCost * std::max(0.0, over_travel) +
                        Limits::kBudgetCost * std::max(0.0, over_moves);
    if (cost < best_.cost) best_ = {h, m, variance, cost};
  }
  if (++candidate_ < Limits::kThresholds) return true;
  candidate_ = 0;
  const bool any = std::exchange(best_.cost, Limits::kNever) < Limits::kNever;
  if (!any || best_.variance > squared(Limits::kLargestGain) * without.variance) return false;
  chosen_ = best_;
  return true;
}

MovePlan MovePlanner::plan(double error, double position, const PlanningState& loop,
                           const OutputLimits& limits, const ValveFriction& friction, bool seen,
                           bool detour_allowed) const noexcept {
  MovePlan plan;
  double distance = (error - chosen_.margin * sign_of(error)) / settings_.gain;
  distance = std::clamp(distance, -settings_.max_move, settings_.max_move);
  const double direction = sign_of(distance);
  // Positions that the stem can reach within the output's limits.
  const double lowest = limits.low - friction.kinetic_offset(-1.0);
  const double highest = limits.high - friction.kinetic_offset(1.0);
  if (lowest > highest) return plan;
  plan.target = std::clamp(position + distance, lowest, highest);
  distance = plan.target - position;
  if (distance * direction <= 0.0) return plan;
  const double detour = Limits::kDetour * (seen ? loop.j : friction.largest_jump(false));
  plan.direct = distance * direction > Limits::kDirect * friction.largest_jump(seen);
  if (plan.direct) {
    plan.first_target = plan.target;
    plan.first_output = plan.target + friction.kinetic_offset(direction);
    plan.possible = true;
    return plan;
  }
  const bool detour_pays = pulse(detour, error, loop) < loop.allowance && detour_allowed;
  if (detour + distance * direction > settings_.max_move || !detour_pays) return plan;
  const double back = -direction;
  const double offset = std::abs(friction.kinetic_offset(back) - friction.centre());
  plan.first_target = position - direction * detour;
  plan.first_output =
      position +
      back * std::max(offset + detour, Limits::kDetourForce * friction.sure_breakaway(back, seen)) +
      friction.centre();
  if (plan.first_output < limits.low || plan.first_output > limits.high) {
    plan.first_target = plan.target + direction * detour;
    plan.first_output = plan.first_target + friction.kinetic_offset(direction);
  }
  plan.possible = plan.first_output >= limits.low && plan.first_output <= limits.high;
  return plan;
}

void MovePlanner::begin(double error, double set_point) noexcept {
  follows_set_point_ = is_new_set_point(set_point);
  if (!follows_set_point_) {
    passed_room_ =
        Limits::kForget * passed_room_ + std::max(0.0, squared(error) - squared(chosen_.margin));
    passed_s_ = Limits::kForget * passed_s_ + since_plan_s_;
  }
  since_plan_s_ = 0.0;
  planned_for_ = set_point;
}

void MovePlanner::learn_landing(double missed) noexcept {
  landing_variance_ += Limits::kLandingWeight * (squared(missed) - landing_variance_);
}

}  // namespace loopwarden::control
