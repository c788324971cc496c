// SPDX-License-Identifier: Apache-2.0
#include "model/control/move_planner.hpp"

#include <catch2/catch.hpp>
#include <cmath>

namespace move_planner_test {

using namespace loopwarden::control;

namespace {

const OutputLimits kLimits{.low = 0.0, .high = 10.0};

PlannedMovesSettings settings() {
  return {
      .gain = 1.5, .time_constant_s = 4.0, .dead_time_s = 2.0, .load = 0.005, .s = 0.6, .j = 0.3};
}

PlanningState loop() {
  return {.baseline = {.variance = 0.04, .travel_rate = 0.01, .cycle_s = 60.0},
          .s = 0.6,
          .j = 0.3,
          .settle_s = 0.5,
          .rate_per_s = 100.0,
          .allowance = 5.0};
}

bool search(MovePlanner& planner, const PlanningState& state, int searches = 1) {
  for (int k = 0; k < 60 * searches; ++k) {
    if (!planner.search(state)) return false;
  }
  return true;
}

MovePlan plan(const MovePlanner& planner, double error, double position, bool detour = true,
              const OutputLimits& limits = kLimits) {
  return planner.plan(error, position, loop(), limits, ValveFriction(settings()), true, detour);
}

}  // namespace

TEST_CASE("the threshold is larger for a load that wanders more", "[control][planned_moves]") {
  const auto threshold = [](double load) {
    PlannedMovesSettings told = settings();
    told.load = load;
    MovePlanner planner(told);
    planner.restart(0.3);
    CHECK(planner.threshold() == Approx(0.225));
    REQUIRE(search(planner, loop(), 3));
    return planner.threshold();
  };
  CHECK(threshold(0.0005) < threshold(0.01));
}

TEST_CASE("no threshold is found where the load wanders too fast or the loop is better without",
          "[control][planned_moves]") {
  PlannedMovesSettings told = settings();
  told.load = 1.0;
  MovePlanner planner(told);
  planner.restart(0.3);
  CHECK_FALSE(search(planner, loop()));
  PlanningState still = loop();
  still.baseline.variance = 1e-8;
  CHECK_FALSE(planner.search(still));
}

TEST_CASE("the action threshold grows with the uncertainty of the disturbance",
          "[control][planned_moves]") {
  MovePlanner planner(settings());
  planner.restart(0.3);
  CHECK(planner.action_threshold(0.0) == Approx(0.225));
  CHECK(planner.action_threshold(0.01) == Approx(std::sqrt(0.225 * 0.225 + 0.04)));
  CHECK(planner.action_threshold(0.0, 2.0) == Approx(0.45));
}

TEST_CASE("a long move is one stroke, a short one goes back first", "[control][planned_moves]") {
  MovePlanner planner(settings());
  planner.restart(0.3);
  const MovePlan far = plan(planner, 1.5, 5.0);
  REQUIRE(far.possible);
  CHECK(far.direct);
  CHECK(far.target == Approx(6.0));
  CHECK(far.first_output == Approx(6.15));  // kinetic offset (s - j)/2
  const MovePlan near = plan(planner, 0.3, 5.0);
  REQUIRE(near.possible);
  CHECK_FALSE(near.direct);
  CHECK(near.target == Approx(5.2));
  CHECK(near.first_target == Approx(5.0 - 1.15 * 0.3));
  CHECK(near.first_output < near.first_target);
  CHECK_FALSE(plan(planner, 0.3, 5.0, false).possible);
}

TEST_CASE("near a limit of CO a short move goes past its target first",
          "[control][planned_moves]") {
  MovePlanner planner(settings());
  planner.restart(0.3);
  const MovePlan near = plan(planner, 0.3, 5.0, true, {.low = 4.9, .high = 10.0});
  REQUIRE(near.possible);
  CHECK(near.first_target == Approx(5.2 + 1.15 * 0.3));
  CHECK_FALSE(plan(planner, 0.3, 5.0, true, {.low = 5.0, .high = 5.1}).possible);
}

TEST_CASE("no move is longer than allowed, a detour included", "[control][planned_moves]") {
  PlannedMovesSettings told = settings();
  told.max_move = 0.5;
  MovePlanner planner(told);
  planner.restart(0.3);
  CHECK(plan(planner, 3.0, 5.0).target == Approx(5.5));
  CHECK_FALSE(plan(planner, 0.3, 5.0).possible);  // 0.2 and a detour of 0.345
}

TEST_CASE("a set point is new until a move was planned for it", "[control][planned_moves]") {
  MovePlanner planner(settings());
  planner.restart(0.3);
  planner.follow(8.0);
  CHECK_FALSE(planner.is_new_set_point(8.2));
  CHECK(planner.is_new_set_point(8.3));
  planner.begin(0.3, 8.3);
  CHECK(planner.follows_set_point());
  CHECK_FALSE(planner.is_new_set_point(8.3));
  planner.begin(0.3, 8.3);
  CHECK_FALSE(planner.follows_set_point());
}

}  // namespace move_planner_test
