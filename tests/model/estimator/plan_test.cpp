// SPDX-License-Identifier: Apache-2.0
#include "model/estimator/plan.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "model/numeric/random.hpp"
#include "tests/model/estimator/estimator_support.hpp"

namespace plan_test {

using namespace loopwarden;
using namespace loopwarden::estimator;

namespace {

constexpr std::size_t kSamples = 20;

// Explanations of a band of `band` CO units.
std::vector<Explanation> sticks_or_plays(double band) {
  numeric::Random random(3);
  std::vector<Explanation> all{{{"stiction"}, 0.6, {}}, {{"backlash"}, 0.4, {}}};
  for (std::size_t i = 0; i < kSamples; ++i) {
    const double s = band * (1.0 + 0.05 * random.normal());
    for (Explanation& e : all) {
      plant::LoopModel model = estimator_test::believed_model();
      model.process.gain *= 1.0 + 0.02 * random.normal();
      model.valve_effects = {{"backlash", {{"deadband", s}}}};
      if (&e == &all.front()) model.valve_effects = {{"stiction", {{"s", s}, {"j", 0.5 * s}}}};
      e.samples.push_back(std::move(model));
    }
  }
  return all;
}

TestStart quiet_loop() {
  return {.set_point = 5.0,
          .output = 4.5,
          .set_points = {0.0, 10.0},
          .outputs = {0.0, 10.0},
          .noise_rms = 0.015,
          .law_error = 0.01,
          .longest_s = 60.0};
}

}  // namespace

TEST_CASE("a visible jump is told from play by a small move of the set point",
          "[estimator][plan]") {
  const Planned planned =
      propose_test(sticks_or_plays(0.4), quiet_loop(), estimator_test::in_order);
  REQUIRE(planned.plan);
  const TestPlan& plan = *planned.plan;
  CHECK(plan.probability_right >= 0.9);
  CHECK(plan.probability_right + plan.probability_wrong <= 1.0 + 1e-9);
  CHECK(plan.pv_swing <= plan.class_share * 12.0 + 0.1);  // the noise moves PV, too
  CHECK(plan.duration_s <= 60.0);
  REQUIRE(plan.predicted.size() == 2);
  for (const Predicted& band : plan.predicted) {
    REQUIRE(band.low.size() == plan.time_s.size());
    for (std::size_t k = 0; k < band.low.size(); ++k) CHECK(band.low[k] <= band.high[k]);
  }
  CHECK(plan.moved.back() == Approx(in_manual(plan.move.kind) ? 4.5 : 5.0));
}

TEST_CASE("a disturbance that hides the difference leaves no test, and says so",
          "[estimator][plan]") {
  TestStart start = quiet_loop();
  start.disturbance = 0.2;
  const Planned planned = propose_test(sticks_or_plays(0.4), start, estimator_test::in_order);
  CHECK_FALSE(planned.plan);
  CHECK_THAT(planned.why_not, Catch::Contains("within 5 % of") && Catch::Contains("disturbance"));
  if (planned.beyond) {
    CHECK(planned.beyond->class_share > 0.05);
    CHECK_THAT(planned.why_not, Catch::Contains("Outside these limits"));
  }
}

TEST_CASE("a loop that answers too slowly for any test is refused with this reason",
          "[estimator][plan]") {
  TestStart start = quiet_loop();
  start.longest_s = 10.0;
  const Planned planned = propose_test(sticks_or_plays(0.4), start, estimator_test::in_order);
  CHECK_FALSE(planned.plan);
  CHECK_FALSE(planned.best);
  CHECK_THAT(planned.why_not, Catch::Contains("too slow"));
}

namespace {

// The right explanation in `right` of ten tests, another one in `wrong`, none in the others.
TestStart judged_so(std::size_t right, std::size_t wrong) {
  TestStart start = quiet_loop();
  start.judge = [right, wrong](const Observed&, Drawn from) {
    std::vector<double> probability{0.5, 0.5};
    if (from.sample < right + wrong) {
      const bool first = (from.explanation == 0) == (from.sample < right);
      probability = first ? std::vector<double>{0.97, 0.03} : std::vector<double>{0.03, 0.97};
    }
    return probability;
  };
  return start;
}

}  // namespace

TEST_CASE("the judge of the caller decides which move is proposed", "[estimator][plan]") {
  const Planned planned =
      propose_test(sticks_or_plays(0.4), judged_so(0, 0), estimator_test::in_order);
  CHECK_FALSE(planned.plan);
  REQUIRE(planned.best);
  CHECK(planned.best->probability_right == 0.0);
}

TEST_CASE("a test that decides in six of ten cases is proposed if it is seldom wrong",
          "[estimator][plan]") {
  const Planned seldom =
      propose_test(sticks_or_plays(0.4), judged_so(6, 0), estimator_test::in_order);
  REQUIRE(seldom.plan);
  CHECK(seldom.plan->probability_right == Approx(0.6));
  CHECK(seldom.why_not.empty());

  const Planned often =
      propose_test(sticks_or_plays(0.4), judged_so(6, 1), estimator_test::in_order);
  CHECK_FALSE(often.plan);
  CHECK_THAT(often.why_not, Catch::Contains("rightly with probability 0.60 and wrongly with 0.10"));
}

TEST_CASE("a loop whose set point must stay is moved in manual, within its output",
          "[estimator][plan]") {
  TestStart start = quiet_loop();
  start.set_points = {5.0, 5.0};
  start.outputs = {4.0, 4.6};
  const Planned planned = propose_test(sticks_or_plays(0.2), start, estimator_test::in_order);
  const std::optional<TestPlan>& plan = planned.plan ? planned.plan : planned.best;
  REQUIRE(plan);
  CHECK(in_manual(plan->move.kind));
  for (const double co : plan->moved) CHECK((co >= 4.0 && co <= 4.6));
}

TEST_CASE("every move starts and ends where the loop was and has its own path",
          "[estimator][plan]") {
  using Kind = MoveKind;
  const auto at = [](Kind kind, std::initializer_list<double> times) {
    std::vector<double> out;
    for (const double t : times) out.push_back(moved({kind, 0.6, 10.0}, 4.0, t));
    return out;
  };
  const auto is = [](std::vector<double> values) { return Catch::Approx(values).margin(1e-9); };
  CHECK_THAT(at(Kind::set_point_pair, {-1, 0, 9.9, 10, 20, 99}), is({4, 4.6, 4.6, 4, 4, 4}));
  CHECK_THAT(at(Kind::output_reversal, {0, 9.9, 10, 19.9, 20}), is({4.6, 4.6, 3.4, 3.4, 4}));
  CHECK_THAT(at(Kind::set_point_stairs, {0, 10, 20, 30, 40, 50, 60}),
             is({4.2, 4.4, 4.6, 4.4, 4.2, 4, 4}));
  CHECK_THAT(at(Kind::output_ramp, {0, 5, 10, 15, 20, 29}), is({4, 4.3, 4.6, 4.3, 4, 4}));
  for (const Kind kind : {Kind::set_point_pair, Kind::set_point_reversal, Kind::set_point_stairs,
                          Kind::set_point_ramp, Kind::output_pair, Kind::output_reversal,
                          Kind::output_stairs, Kind::output_ramp}) {
    CHECK(move_from_text(to_text(kind)) == kind);
    CHECK(moved({kind, 0.6, 10.0}, 4.0, duration_s({kind, 0.6, 10.0})) == 4.0);
    CHECK(in_manual(kind) == (std::string(to_text(kind)).rfind("output", 0) == 0));
  }
  CHECK_FALSE(move_from_text("set_point"));
}

TEST_CASE("the same explanations give the same plan in any order of the work",
          "[estimator][plan]") {
  const Planned a = propose_test(sticks_or_plays(0.4), quiet_loop(), estimator_test::in_order);
  const Planned b = propose_test(sticks_or_plays(0.4), quiet_loop(), estimator_test::in_reverse);
  REQUIRE(a.plan);
  REQUIRE(b.plan);
  CHECK(a.plan->move.size == b.plan->move.size);
  CHECK(a.plan->probability_right == b.plan->probability_right);
}

}  // namespace plan_test
