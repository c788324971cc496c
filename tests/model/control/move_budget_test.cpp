// SPDX-License-Identifier: Apache-2.0
#include "model/control/move_budget.hpp"

#include <catch2/catch.hpp>

namespace move_budget_test {

using namespace loopwarden::control;

namespace {

void pass(MoveBudget& budget, double seconds) {
  for (int k = 0; k < static_cast<int>(seconds); ++k) budget.pass();
}

}  // namespace

TEST_CASE("no hour has more moves than the budget", "[control][planned_moves]") {
  MoveBudget budget(2.0, 1.0);
  CHECK_FALSE(budget.allows(1.0));
  budget.restart(0.3);
  CHECK(budget.allows(2.0));
  budget.plan(2.0);
  budget.count(false);
  budget.count(false);
  pass(budget, 3500.0);
  CHECK_FALSE(budget.allows(1.0));
  pass(budget, 200.0);
  CHECK(budget.allows(2.0));
}

TEST_CASE("half a move per hour is one move in two hours", "[control][planned_moves]") {
  MoveBudget budget(0.5, 1.0);
  budget.restart(0.3);
  budget.plan(1.0);
  budget.count(false);
  pass(budget, 7000.0);
  CHECK_FALSE(budget.allows(1.0));
  pass(budget, 400.0);
  CHECK(budget.allows(1.0));
}

TEST_CASE("the stem's moves count after new settings, a shadow's do not",
          "[control][planned_moves]") {
  const bool shadow = GENERATE(true, false);
  MoveBudget before(2.0, 1.0);
  before.restart(0.3);
  before.count(shadow);
  before.count(shadow);
  MoveBudget after(2.0, 1.0);
  after.continue_hour(before, false);
  after.restart(0.3);
  CHECK(after.allows(1.0) == shadow);
}

TEST_CASE("a shadow that begins to act keeps the moves of the stem", "[control][planned_moves]") {
  MoveBudget budget(2.0, 1.0);
  budget.restart(0.3);
  budget.count(true);
  budget.count(true);
  CHECK_FALSE(budget.allows(1.0));
  budget.begin_acting();
  CHECK(budget.allows(2.0));
}

TEST_CASE("travel is earned at 95 % of the baseline, and bounded", "[control][planned_moves]") {
  const LoopBaseline baseline{.variance = 1.0, .travel_rate = 0.01, .cycle_s = 10.0};
  MoveBudget budget(60.0, 1.0);
  budget.restart(0.3);
  CHECK(budget.travel() == Approx(2.4));
  for (int k = 0; k < 100; ++k) budget.earn_travel(baseline, 0.3);
  CHECK(budget.travel() == Approx(3.35));
  for (int k = 0; k < 1000; ++k) budget.earn_travel(baseline, 0.3);
  CHECK(budget.travel() == Approx(4.5));
  budget.spend_travel(100.0, 0.3);
  CHECK(budget.travel() == Approx(-2.4));
}

}  // namespace move_budget_test
