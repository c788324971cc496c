// SPDX-License-Identifier: Apache-2.0
#include "model/analysis/rule_trial.hpp"

#include <catch2/catch.hpp>
#include <cmath>

namespace loopwarden::tests::rule_trial_test {
namespace {

using namespace loopwarden::analysis;

plant::LoopModel plant_of(double gain) {
  plant::LoopModel model;
  model.process = {.gain = gain, .time_constant_s = 10.0, .dead_time_s = 2.0};
  model.controller.pid.gains = {.kp = 0.2, .ki = 0.01};
  model.controller.pid.action = gain < 0.0 ? control::Action::direct : control::Action::reverse;
  model.transmitter.high = 100.0;
  return model;
}

const RuleTrial& of(const std::vector<RuleTrial>& trials, TuningRule rule) {
  for (const RuleTrial& trial : trials) {
    if (trial.rule == rule) return trial;
  }
  FAIL("the rule was not tried");
  return trials.front();
}

TEST_CASE("the gains in force come first, and what is recommended leaves the margin and is best") {
  const auto trials = try_rules(plant_of(1.0));
  CHECK_FALSE(trials.front().rule);
  CHECK(trials.front().gains.kp == 0.2);
  const RuleTrial* best = recommended(trials);
  REQUIRE(best != nullptr);
  CHECK(best->margins.sensitivity <= kMostSensitivity);
  for (const RuleTrial& trial : trials) {
    if (!trial.rule || !trial.scales() || trial.margins.sensitivity > kMostSensitivity) continue;
    CHECK(trial.response.load_absolute_error >= best->response.load_absolute_error);
  }
  // SIMC with tc = L by hand: kp = T/(K 2 L), Ti = min(T, 8 L).
  const RuleTrial& simc = of(trials, TuningRule::simc);
  CHECK(simc.gains.kp == Approx(2.5));
  CHECK(simc.gains.ki == Approx(0.25));
  // The error's integral is D / (K ki) of a load step D; that of its size is more, as far as PV swings.
  CHECK(simc.response.load_absolute_error > 10.0 / 0.25);
  CHECK(simc.response.load_absolute_error < 1.2 * 10.0 / 0.25);
}

TEST_CASE("what leaves out the gain is never recommended, though it may be best") {
  const auto trials = try_rules(plant_of(0.8));
  REQUIRE_FALSE(of(trials, TuningRule::zn_thesis).scales());
  const RuleTrial* best = recommended(trials);
  REQUIRE(best != nullptr);
  CHECK(best->rule != TuningRule::zn_thesis);
}

TEST_CASE("a process that falls is tuned as one that rises") {
  const auto rising = try_rules(plant_of(2.0));
  const auto falling = try_rules(plant_of(-2.0));
  REQUIRE(rising.size() == falling.size());
  for (std::size_t i = 1; i < rising.size(); ++i) {
    CHECK(rising[i].gains == falling[i].gains);
    CHECK(rising[i].margins.sensitivity == Approx(falling[i].margins.sensitivity));
  }
}

TEST_CASE("a filter that is given stands in the place of the rule's") {
  const TuningOptions pid{.form = ControllerForm::pid};
  CHECK(of(try_rules(plant_of(1.0), pid), TuningRule::zn).gains.derivative_filter_s == Approx(0.1));
  CHECK(of(try_rules(plant_of(1.0), pid, 0.7), TuningRule::zn).gains.derivative_filter_s == 0.7);
}

}  // namespace
}  // namespace loopwarden::tests::rule_trial_test
