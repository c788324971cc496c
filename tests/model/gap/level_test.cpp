// SPDX-License-Identifier: Apache-2.0
#include "model/gap/level.hpp"

#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "model/gap/workflow.hpp"
#include "tests/model/gap/gap_support.hpp"

namespace level_test {

using namespace loopwarden;

namespace {

// A heater in degC: PV = 22 + 0.5 CO, with two lags.
plant::LoopModel heater() {
  plant::LoopModel model;
  model.sample_time_s = 1.0;
  model.controller.pid.gains = {.kp = 4.0, .ki = 0.05};
  model.controller.pid.output_low = 0.0;
  model.controller.pid.output_high = 100.0;
  model.process = {
      .gain = 0.5, .time_constant_s = 60.0, .dead_time_s = 5.0, .second_time_constant_s = 12.0};
  model.uncertainty = {.gain = 0.1, .time_constant = 0.1, .dead_time = 0.2};
  model.transmitter = {.low = 0.0, .high = 100.0, .resolution = 0.0, .noise = 0.0};
  return model;
}

// PV of `truth` at rest at CO 0, then with manual CO. The record begins at the first of the steps.
numeric::LoopRecord driven_from_cold(const plant::LoopModel& truth, std::size_t samples = 900) {
  plant::Plant plant(truth, 1);
  plant.reset(0.0);
  numeric::Random random(5);
  numeric::LoopRecord record{.period_s = truth.sample_time_s, .pv = {}, .sp = {}, .co = {}};
  double co = 60.0;
  for (std::size_t k = 0; k < samples; ++k) {
    if (k % 90 == 0) co = 20.0 + 60.0 * random.uniform();
    record.co.push_back(co);
    record.pv.push_back(plant.process_variable() + 0.05 * random.normal());
    plant.step(co);
  }
  return record;
}

gap::Result found(const numeric::LoopRecord& record, const plant::LoopModel& model,
                  bool several = false) {
  return gap::find_gap(record, model, {.search = {.several = several}}, test::serial,
                       [](double) {});
}

}  // namespace

TEST_CASE("A level that the model does not state is no fault of a valve", "[gap][level]") {
  plant::LoopModel truth = heater();
  truth.process.level = GENERATE(22.0, 41.0);
  const gap::Result result = found(driven_from_cold(truth), heater());
  INFO(result.sentence);
  REQUIRE(result.effects.size() == 1);
  CHECK(result.effects[0].spec.name == "output_bias");
  CHECK(result.effects[0].spec.parameters.at("bias") == Approx(*truth.process.level).margin(0.5));
  const auto& interval = result.effects[0].interval.at("bias");
  CHECK((interval[0] < *truth.process.level && *truth.process.level < interval[1]));
  CHECK_THAT(result.effects[0].evidence, Catch::Contains("process.level"));
  CHECK(result.after.holdout_rmse < 0.1);
  REQUIRE(result.corrected.transmitter_effects.size() == 1);
}

TEST_CASE("A cold start is no effect, with one lag and with two", "[gap][level]") {
  plant::LoopModel model = heater();
  model.process.level = 22.0;
  if (GENERATE(false, true)) model.process.second_time_constant_s = 0.0;
  const gap::Result result = found(driven_from_cold(model), model);
  INFO(result.sentence);
  CHECK(result.outcome == gap::Outcome::no_gap);
  CHECK(result.before.rmse == Approx(0.05).epsilon(0.2));
}

TEST_CASE("PV off the level that the model states is a bias", "[gap][level]") {
  plant::LoopModel model = heater();
  model.process.level = 22.0;
  plant::LoopModel truth = model;
  truth.process.level = 25.0;
  const gap::Result result = found(driven_from_cold(truth), model);
  REQUIRE(result.effects.size() == 1);
  CHECK(result.effects[0].spec.name == "output_bias");
  CHECK(result.effects[0].spec.parameters.at("bias") == Approx(3.0).margin(0.2));
}

TEST_CASE("A level of 0 needs no key", "[gap][level]") {
  const gap::Result result = found(driven_from_cold(heater()), heater());
  CHECK(result.outcome == gap::Outcome::no_gap);
  CHECK_FALSE(result.corrected.process.level.has_value());
}

TEST_CASE("A valve that sticks above an unknown base is found as one", "[gap][level][long]") {
  plant::LoopModel model = test::believed_model();
  model.transmitter.high = 20.0;
  plant::LoopModel truth = model;
  truth.process.level = 6.0;
  truth.valve_effects = {{"stiction", {{"s", 0.9}, {"j", 0.3}}}};
  const std::vector<double> co = test::exciting_output(900);
  numeric::LoopRecord record{.period_s = 0.1, .pv = test::driven(truth, co), .sp = {}, .co = co};
  numeric::Random random(3);
  for (double& pv : record.pv) pv += 0.015 * random.normal();
  const gap::Result result = found(record, model);
  INFO(result.sentence);
  REQUIRE(result.effects.size() == 2);
  CHECK(result.effects[0].spec.name == "stiction");
  CHECK(result.effects[0].spec.parameters.at("s") == Approx(0.9).epsilon(0.15));
  CHECK(result.effects[1].spec.name == "output_bias");
  CHECK(result.effects[1].spec.parameters.at("bias") == Approx(6.0).margin(0.4));
}

TEST_CASE("A model without a valve has no valve effects as candidates", "[gap][level]") {
  plant::LoopModel model = heater();
  model.has_valve = false;
  plant::LoopModel truth = heater();
  truth.valve_effects = {{"backlash", {{"deadband", 8.0}}}};
  const gap::Result result = found(driven_from_cold(truth), model);
  for (const gap::TriedCandidate& tried : result.candidates) {
    CHECK(tried.block != effects::Block::valve);
  }
  for (const gap::FoundEffect& effect : result.effects) {
    CHECK(effect.block != effects::Block::valve);
  }
}

}  // namespace level_test
