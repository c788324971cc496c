// SPDX-License-Identifier: Apache-2.0
#include "lab/calm_study/calm_trial.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <string>

namespace calm_trial_test {

using namespace loopwarden;
using namespace loopwarden::lab;

namespace {

// Gain 1, so that 1 V is 1 PV unit; no noise.
CalmTrial quiet_trial() {
  CalmTrial trial;
  plant::LoopModel& model = trial.model;
  model.controller.pid.gains = {.kp = 0.3, .ki = 0.1};
  model.controller.pid.output_high = 10.0;
  model.controller.output.high = 10.0;
  model.controller.set_point.high = 10.0;
  model.process = {.gain = 1.0, .time_constant_s = 2.0, .dead_time_s = 1.0};
  model.scenario.set_point = {{0.0, 4.0}, {0.0, 6.0}};
  trial.hold_s = 300.0;
  trial.settling_s = 100.0;
  return trial;
}

CalmTrial sticky_trial() {
  CalmTrial trial = quiet_trial();
  trial.model.valve_effects = {{.name = "stiction",
                                .parameters = {{"s", 1.0}, {"j", 0.5}},
                                .options = {{"law", "he"}},
                                .table = {}}};
  // Away from the rest at which every run starts.
  trial.model.disturbances = {{.name = "step_disturbance",
                               .parameters = {{"size", 0.2}, {"time", 1.0}},
                               .options = {},
                               .table = {}}};
  trial.model.scenario.set_point = {{0.0, 4.0}, {0.0, 5.2}};
  trial.hold_s = 3600.0;
  trial.settling_s = 1200.0;
  return trial;
}

}  // namespace

TEST_CASE("a healthy loop without noise settles on each set point", "[calm][studies]") {
  const TrialResult result = run_trial(quiet_trial());
  CHECK(result.settled.rms_error < 1e-4);
  CHECK(result.pv_swing < 1e-3);
  CHECK(result.settled.travel_per_hour == Approx(0.0).margin(0.1));
  CHECK_FALSE(result.parked);
  // The step of 2 lasts for about dead time + lag of the 600 s.
  CHECK(result.whole_rms_error > 0.1);
  CHECK(result.whole_rms_error < 0.4);
}

TEST_CASE("paper settles a healthy valve with read-back bias b at Ks b / Ki, the others at zero",
          "[calm][studies]") {
  CalmTrial trial = quiet_trial();
  trial.read_back.bias = -0.05;  // u - u_valve = 0.05 V
  const double gain_per_s = 0.4;
  trial.model.controller.jacket = {.gain_per_s = gain_per_s, .dead_zone = 0.02};
  control::JacketForm& form = trial.model.controller.jacket.form;

  form = control::JacketForm::paper;
  const TrialResult paper = run_trial(trial);
  CHECK(paper.settled.mean_error == Approx(gain_per_s * 0.05 / 0.1).epsilon(1e-3));
  CHECK(paper.parked);

  form = control::JacketForm::bounded;
  const TrialResult bounded = run_trial(trial);
  CHECK(bounded.settled.mean_error == Approx(0.0).margin(1e-3));
  CHECK_FALSE(bounded.parked);

  form = control::JacketForm::dwell;
  const TrialResult dwell = run_trial(trial);
  CHECK(dwell.settled.mean_error == Approx(0.0).margin(1e-3));
  CHECK_FALSE(dwell.parked);
}

TEST_CASE("a limit cycle is measured correctly", "[calm][studies]") {
  const TrialResult result = run_trial(sticky_trial());
  CHECK_FALSE(result.parked);
  // PV swings by gain times slip jump, the stem moves by the jump at each reversal.
  CHECK(result.pv_swing == Approx(0.5).epsilon(0.05));
  CHECK(result.settled.travel_per_hour ==
        Approx(0.5 * result.settled.reversals_per_hour).epsilon(0.05));
  // Two reversals per period.
  CHECK(result.settled.reversals_per_hour ==
        Approx(2.0 * 3600.0 / result.settled.period_s).epsilon(0.1));
  // CO crosses the stick band; the proportional term adds a little.
  CHECK(result.co_swing > 0.95);
  CHECK(result.co_swing < 1.15);
}

TEST_CASE("paper parks a sticky valve off the set point", "[calm][studies]") {
  CalmTrial trial = sticky_trial();
  trial.model.controller.jacket = {.form = control::JacketForm::paper, .gain_per_s = 1.0};
  const TrialResult result = run_trial(trial);
  CHECK(result.parked);
  CHECK(result.settled.reversals_per_hour == 0.0);
  CHECK(result.settled.rms_error > 0.2);
}

TEST_CASE("the converter and the read-back have their resolution", "[calm][studies]") {
  CalmTrial trial = quiet_trial();
  trial.model.scenario.set_point = {{0.0, 4.2}, {0.0, 6.3}};
  trial.output_resolution = 0.5;  // too coarse for a loop to settle
  CHECK(run_trial(trial).settled.rms_error > 0.05);

  trial.output_resolution = 0.0;
  trial.model.controller.jacket = {.form = control::JacketForm::paper, .gain_per_s = 0.4};
  trial.read_back.resolution = 5.0;  // always reads 5 V
  const TrialResult coarse = run_trial(trial);
  CHECK(std::abs(coarse.settled.mean_error) > 0.01);
}

TEST_CASE("the same trial gives the same bits, another seed does not", "[calm][studies]") {
  CalmTrial trial = sticky_trial();
  trial.model.transmitter.noise = 0.01;
  trial.read_back.noise = 0.01;
  trial.model.controller.jacket = {.form = control::JacketForm::dwell, .dead_zone = 0.05};
  const double first = run_trial(trial).settled.rms_error;
  CHECK(run_trial(trial).settled.rms_error == first);
  trial.model.scenario.seed = 2;
  CHECK(run_trial(trial).settled.rms_error != first);
}

}  // namespace calm_trial_test
