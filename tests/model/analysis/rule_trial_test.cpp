// SPDX-License-Identifier: Apache-2.0
#include "model/analysis/rule_trial.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "model/analysis/limits.hpp"

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

// A response that is steady, settles and leaves enough margin.
RuleTrial tried(std::optional<TuningRule> rule, double load_absolute_error) {
  RuleTrial trial{.rule = rule, .gains = {}};
  trial.margins.sensitivity = AnalysisLimits::kMostSensitivity;
  trial.response.load_absolute_error = load_absolute_error;
  trial.response.settles = true;
  return trial;
}

TEST_CASE(
    "the gains in force are listed first, then each rule with its own gains and their effect") {
  struct ByHand {
    TuningRule rule;
    double kp, ti_s;
  };
  // K = 2, T = 10 s, L = 2 s.
  const std::vector<ByHand> expected{
      {TuningRule::zn_thesis, 4.5, 6.6667},     {TuningRule::zn, 2.25, 6.6667},
      {TuningRule::cohen_coon, 2.2917, 4.7077}, {TuningRule::lambda, 0.41667, 10.0},
      {TuningRule::simc, 1.25, 10.0},           {TuningRule::amigo, 0.60278, 7.7652}};
  plant::LoopModel model = plant_of(2.0);
  const auto trials = try_rules(model);
  REQUIRE(trials.size() == 1 + expected.size());
  CHECK_FALSE(trials.front().rule);
  CHECK(trials.front().name() == "as it is");
  CHECK(trials.front().gains == model.controller.pid.gains);
  for (std::size_t i = 0; i < trials.size(); ++i) {
    const RuleTrial& trial = trials[i];
    CAPTURE(trial.name());
    if (i > 0) {
      CHECK(trial.rule == expected[i - 1].rule);
      CHECK(trial.name() == to_text(expected[i - 1].rule));
      CHECK(trial.gains.kp == Approx(expected[i - 1].kp).epsilon(1e-4));
      CHECK(trial.gains.ki == Approx(expected[i - 1].kp / expected[i - 1].ti_s).epsilon(1e-4));
    }
    model.controller.pid.gains = trial.gains;
    CHECK(trial.margins.sensitivity == margins(linear_loop(model)).sensitivity);
    // After a load step D the integral of the error is D / (K ki). The integral of its absolute
    // value is larger by the swings of PV.
    const double integral = 10.0 / (2.0 * trial.gains.ki);
    CHECK(trial.response.load_absolute_error > 0.999 * integral);
    if (trial.margins.sensitivity < 1.7) {
      CHECK(trial.response.load_absolute_error < 1.2 * integral);
    }
  }
  // The integrals: SIMC 40, AMIGO 64, lambda 120 PV units s. The Ziegler-Nichols tuning swings for
  // long.
  REQUIRE(recommended(trials) != nullptr);
  CHECK(recommended(trials)->rule == TuningRule::simc);
}

TEST_CASE("the recommended rule is the allowed one that handles a load best") {
  std::vector<RuleTrial> trials{tried(std::nullopt, 1.0),       tried(TuningRule::zn_thesis, 2.0),
                                tried(TuningRule::zn, 3.0),     tried(TuningRule::cohen_coon, 4.0),
                                tried(TuningRule::lambda, 5.0), tried(TuningRule::simc, 7.0),
                                tried(TuningRule::amigo, 6.0)};
  trials[2].margins.sensitivity = 1.01 * AnalysisLimits::kMostSensitivity;
  trials[3].margins.stable = false;
  trials[4].response.settles = false;
  REQUIRE(recommended(trials) != nullptr);
  CHECK(recommended(trials)->rule == TuningRule::amigo);
  trials[6].response.load_absolute_error = 8.0;
  CHECK(recommended(trials)->rule == TuningRule::simc);
  trials.resize(5);
  CHECK(recommended(trials) == nullptr);
}

TEST_CASE("the steps are watched long enough for the slowest rule") {
  CHECK(watched_s({.gain = 1.0, .time_constant_s = 10.0, .dead_time_s = 2.0}) == Approx(330.0));
  CHECK(watched_s({.gain = 1.0,
                   .time_constant_s = 10.0,
                   .dead_time_s = 2.0,
                   .second_time_constant_s = 4.0}) == Approx(450.0));
  CHECK(watched_s({.gain = 1.0, .dead_time_s = 2.0, .kind = plant::ProcessKind::integrating}) ==
        Approx(200.0));
  const auto trials = try_rules(plant_of(1.0));
  for (const RuleTrial& trial : trials) {
    const auto& record = trial.response.record;
    CAPTURE(trial.name());
    const auto samples = static_cast<double>(record.pv.size());
    CHECK(record.period_s * static_cast<double>(trial.response.load_from) >= 330.0);
    CHECK(record.period_s * (samples - static_cast<double>(trial.response.load_from)) >= 330.0);
  }
}

TEST_CASE("a process that falls is tuned as one that rises") {
  const auto rising = try_rules(plant_of(2.0));
  const auto falling = try_rules(plant_of(-2.0));
  REQUIRE(rising.size() == falling.size());
  for (std::size_t i = 1; i < rising.size(); ++i) {
    CHECK(rising[i].rule == falling[i].rule);
    CHECK(rising[i].gains == falling[i].gains);
    CHECK(rising[i].margins.sensitivity == Approx(falling[i].margins.sensitivity));
  }
}

TEST_CASE("a given filter replaces the filter of the rule") {
  const TuningOptions pid{.form = ControllerForm::pid};
  CHECK(of(try_rules(plant_of(1.0), pid), TuningRule::zn).gains.derivative_filter_s == Approx(0.1));
  const auto trials = try_rules(plant_of(1.0), pid, 0.7);
  REQUIRE(trials.size() == 5);  // two rules have no PID
  for (std::size_t i = 1; i < trials.size(); ++i) {
    CHECK(trials[i].gains.derivative_filter_s == 0.7);
    CHECK(trials[i].gains.kd > 0.0);
  }
  CHECK(trials.front().gains.derivative_filter_s == 0.0);  // unchanged
}

}  // namespace
}  // namespace loopwarden::tests::rule_trial_test
