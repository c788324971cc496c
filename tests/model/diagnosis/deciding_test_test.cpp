// SPDX-License-Identifier: Apache-2.0
#include "model/diagnosis/deciding_test.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "tests/model/diagnosis/signals.hpp"
#include "tests/model/estimator/estimator_support.hpp"

namespace deciding_test_test {

using namespace loopwarden;
using namespace loopwarden::diagnosis;
using estimator_test::in_order;

namespace {

// A loop whose valve sticks a little; `scale` is that of CO.
Diagnosis sticking(double scale, double noise = 0.02) {
  const tests::SmallLoop loop{.gain = 0.3, .integral_time = 2.0, .noise = noise};
  double stem = 50.0;
  auto run = loop.run(
      1500,
      [&](double co) {
        if (std::abs(co - stem) > 2.0) stem = co;
        return stem;
      },
      tests::wandering_load(0.0));
  for (double& co : run.co) co *= scale;
  numeric::LoopView view{.pv = run.pv, .co = run.co};
  view.period_s = 0.5;
  view.co_high = 100.0 * scale;
  return diagnose(view);
}

TestedLoop loop_of(double scale) {
  return {.period_s = 0.5, .outputs = {0.0, 100.0 * scale}, .pv_range = {{0.0, 100.0}}};
}

}  // namespace

TEST_CASE("a test of the valve has a size of the loop's band, and a class", "[deciding_test]") {
  const Diagnosis d = sticking(1.0);
  REQUIRE(d.band.band > 0.0);
  const std::optional<DecidingTest> test = plan_deciding_test(d, loop_of(1.0), in_order);
  REQUIRE(test);
  REQUIRE(test->planned.plan);
  const estimator::TestPlan& plan = *test->planned.plan;
  CHECK(estimator::in_manual(plan.move.kind));
  CHECK(std::abs(plan.move.size) <= 3.0 * test->band);
  CHECK(plan.move.hold_s >= 30.0);
  CHECK(plan.class_share <= 0.05);
  CHECK(test->pv_span == 100.0);
  CHECK(test->pv_span_known);
  CHECK(plan.probability_right >= 0.9);
  CHECK(plan.predicted.size() == test->explanations.size());
}

TEST_CASE("the same loop in other units of CO gets the same test", "[deciding_test]") {
  const std::optional<DecidingTest> percent =
      plan_deciding_test(sticking(1.0), loop_of(1.0), in_order);
  const std::optional<DecidingTest> volts =
      plan_deciding_test(sticking(0.1), loop_of(0.1), in_order);
  REQUIRE(percent);
  REQUIRE(volts);
  REQUIRE(percent->planned.plan);
  REQUIRE(volts->planned.plan);
  CHECK(volts->planned.plan->move.size ==
        Approx(0.1 * percent->planned.plan->move.size).epsilon(0.01));
}

TEST_CASE("a loop that its disturbance moves farther than a test may has none within the limits",
          "[deciding_test]") {
  TestedLoop loop = loop_of(1.0);
  loop.pv_range = {{19.5, 20.5}};
  const std::optional<DecidingTest> test = plan_deciding_test(sticking(1.0, 0.5), loop, in_order);
  REQUIRE(test);
  CHECK_FALSE(test->planned.plan);
  CHECK_FALSE(test->planned.why_not.empty());
}

TEST_CASE("a record without movement gets no test", "[deciding_test]") {
  Diagnosis d = sticking(1.0);
  d.band = {};
  CHECK_FALSE(plan_deciding_test(d, loop_of(1.0), in_order));
}

}  // namespace deciding_test_test
