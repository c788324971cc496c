// SPDX-License-Identifier: Apache-2.0
// The stickband jacket in the closed loop of the thesis's plant 1, as described in
// docs/explanation/compensators.md.
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdint>
#include <string>

#include "model/plant/simulated_loop.hpp"
#include "lab/calm_study/calm_trial.hpp"

namespace jacket_closed_loop_test {

using namespace loopwarden;
using control::JacketForm;
using lab::CalmTrial;
using lab::run_trial;
using lab::TrialResult;

namespace {

constexpr double kResolution = 10.0 / 4096.0;  // V

plant::LoopModel plant_1() {
  plant::LoopModel m;
  m.controller.pid.gains = {.kp = 0.61145 / 1.75, .ki = 0.070013 / 1.75};
  m.controller.pid.output_high = 10.0;
  m.controller.output.high = 10.0;
  m.controller.set_point.high = 10.0;
  m.process = {.gain = 1.2264, .time_constant_s = 1.69376, .dead_time_s = 2.6256};
  m.transmitter = {.resolution = kResolution, .noise = 0.01};
  m.scenario.set_point = {{0.0, 4.0}, {10.0, 5.0}};
  return m;
}

plant::LoopModel sticky_plant_1(const std::string& law) {
  plant::LoopModel m = plant_1();
  m.valve_effects = {{.name = "stiction",
                      .parameters = {{"s", 1.5}, {"j", 1.2}},
                      .options = {{"law", law}},
                      .table = {}}};
  return m;
}

// Two hours at each of eight set points, so that the chance in the valve's sticking positions
// averages out.
CalmTrial trial_with(const plant::LoopModel& model, JacketForm form) {
  CalmTrial trial;
  trial.model = model;
  trial.model.controller.jacket = {.form = form, .gain_per_s = 1.0, .dead_zone = 0.03};
  trial.model.scenario.set_point.clear();
  for (const double set_point : {5.0, 5.6, 4.7, 6.1, 5.3, 4.1, 6.4, 5.0}) {
    trial.model.scenario.set_point.emplace_back(0.0, set_point);
  }
  trial.hold_s = 7200.0;
  trial.settling_s = 1800.0;
  return trial;
}

}  // namespace

TEST_CASE("dwell reduces RMS of SP - PV and stem travel if the valve sticks",
          "[closed_loop][jacket]") {
  const std::string law = GENERATE("choudhury", "he", "karnopp");
  CAPTURE(law);
  const TrialResult off = run_trial(trial_with(sticky_plant_1(law), JacketForm::off));
  const TrialResult dwell = run_trial(trial_with(sticky_plant_1(law), JacketForm::dwell));
  CHECK(dwell.settled.rms_error < 0.9 * off.settled.rms_error);
  CHECK(dwell.settled.travel_per_hour < 0.6 * off.settled.travel_per_hour);
  CHECK(std::abs(dwell.settled.mean_error) < 0.4 * off.settled.rms_error);
  CHECK_FALSE(dwell.parked);
  CHECK(dwell.whole_rms_error < off.whole_rms_error);
}

TEST_CASE("paper at its optimum of Ks = 1 parks off the set point instead of cycling less",
          "[closed_loop][jacket]") {
  const TrialResult off = run_trial(trial_with(sticky_plant_1("karnopp"), JacketForm::off));
  const TrialResult paper = run_trial(trial_with(sticky_plant_1("karnopp"), JacketForm::paper));
  CHECK(paper.parked);
  CHECK(paper.settled.reversals_per_hour == 0.0);
  CHECK(paper.settled.rms_error > off.settled.rms_error);
}

TEST_CASE("bounded keeps the loop moving, and cycles slower instead of faster",
          "[closed_loop][jacket]") {
  const TrialResult off = run_trial(trial_with(sticky_plant_1("he"), JacketForm::off));
  const TrialResult bounded = run_trial(trial_with(sticky_plant_1("he"), JacketForm::bounded));
  CHECK_FALSE(bounded.parked);
  CHECK(bounded.settled.reversals_per_hour < 0.8 * off.settled.reversals_per_hour);
  CHECK(bounded.settled.reversals_per_hour > 0.0);
}

TEST_CASE("on a healthy valve dwell has no effect", "[closed_loop][jacket]") {
  const TrialResult off = run_trial(trial_with(plant_1(), JacketForm::off));
  CalmTrial trial = trial_with(plant_1(), JacketForm::dwell);
  trial.read_back = {.bias = 0.3, .noise = 0.005, .resolution = kResolution};
  const TrialResult dwell = run_trial(trial);
  CHECK(dwell.settled.rms_error == Approx(off.settled.rms_error).epsilon(0.01));
  CHECK(dwell.whole_rms_error == Approx(off.whole_rms_error).epsilon(0.01));
}

TEST_CASE("a jacket in shadow leaves the loop as it is, bit for bit", "[closed_loop][jacket]") {
  const JacketForm form = GENERATE(JacketForm::paper, JacketForm::bounded, JacketForm::dwell);
  plant::LoopModel shadowed_model = sticky_plant_1("karnopp");
  shadowed_model.controller.jacket = {.form = form, .shadow = true, .dead_zone = 0.03};
  plant::SimulatedLoop plain(sticky_plant_1("karnopp"), kResolution);
  plant::SimulatedLoop shadowed(shadowed_model, kResolution);
  double asked_for = 0.0;
  for (int k = 0; k < 20000; ++k) {
    const plant::LoopSample a = plain.step();
    const plant::LoopSample b = shadowed.step();
    REQUIRE(a.co == b.co);
    REQUIRE(a.pv == b.pv);
    REQUIRE(b.jacket_rate == 0.0);
    asked_for += std::abs(b.jacket_shadow_rate);
  }
  CHECK(asked_for > 0.0);
}

TEST_CASE("switching the jacket on and off is bumpless", "[closed_loop][jacket]") {
  const JacketForm form = GENERATE(JacketForm::paper, JacketForm::bounded, JacketForm::dwell);
  const plant::LoopModel model = sticky_plant_1("he");
  control::ControllerSettings with_jacket = model.controller;
  with_jacket.jacket = {.form = form, .gain_per_s = 0.2, .dead_zone = 0.03};
  plant::SimulatedLoop loop(model);
  bool on = false;
  bool acted = false;
  for (int k = 1; k <= 60000; ++k) {
    if (k % 1000 != 0) {
      acted = acted || loop.step().jacket_rate != 0.0;
      continue;
    }
    // The same loop continues unswitched in parallel. In the period of the change the two are
    // equal.
    plant::SimulatedLoop unswitched = loop;
    on = !on;
    loop.controller().configure(on ? with_jacket : model.controller);
    const plant::LoopSample a = loop.step();
    const plant::LoopSample b = unswitched.step();
    REQUIRE(a.pv == b.pv);
    REQUIRE(a.co == Approx(b.co).margin(1e-9));
  }
  CHECK(acted);
}

}  // namespace jacket_closed_loop_test
