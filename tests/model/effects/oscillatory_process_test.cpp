// SPDX-License-Identifier: Apache-2.0
#include "model/effects/oscillatory_process/oscillatory_process.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>
#include <vector>

#include "tests/model/effects/search_support.hpp"

namespace oscillatory_process_test {

using namespace loopwarden;

TEST_CASE("the lag is replaced: a step rings as second order does",
          "[effects][oscillatory_process]") {
  constexpr double kDamping = 0.3;
  constexpr double kFrequency = 0.8;  // rad/s
  plant::LoopModel model = test::believed_model();
  model.process = {.gain = 2.0, .time_constant_s = 7.0, .dead_time_s = 0.5};
  model.transmitter = {.low = -100.0, .high = 100.0};
  model.process_effects = {
      {"oscillatory_process", {{"damping", kDamping}, {"natural_frequency", kFrequency}}}};
  plant::Plant plant(model, 1);  // replaces the lag of the model
  plant.reset(1.0);
  CHECK(plant.process_variable() == Approx(2.0));
  const double root = std::sqrt(1.0 - kDamping * kDamping);
  for (int k = 1; k <= 400; ++k) {
    const double pv = plant.step(3.0);
    const double t = std::max(0.0, 0.1 * k - 0.5);
    const double swing =
        std::exp(-kDamping * kFrequency * t) *
        (std::cos(root * kFrequency * t) + kDamping / root * std::sin(root * kFrequency * t));
    REQUIRE(pv == Approx(2.0 + 4.0 * (1.0 - swing)).margin(1e-9));
  }
}

TEST_CASE("without a process the lag must be stated", "[effects][oscillatory_process]") {
  effects::EffectSpec spec{"oscillatory_process", {{"damping", 0.3}, {"natural_frequency", 0.8}}};
  CHECK_THROWS_WITH(effects::check_effect(spec, effects::Block::process, {}),
                    "time_constant of the lag that it replaces is missing");
  effects::complete(spec, {.time_constant_s = 4.0});
  CHECK(spec.parameters.at("time_constant") == 4.0);
  CHECK_NOTHROW(effects::check_effect(spec, effects::Block::process, {}));
  effects::complete(spec, {.time_constant_s = 9.0});
  CHECK(spec.parameters.at("time_constant") == 4.0);  // a given value is kept
}

TEST_CASE("a process that rings is found in damping and frequency, a lag stays a lag",
          "[effects][oscillatory_process]") {
  const std::vector<std::string> names{"oscillatory_process", "positioner_overshoot", "extra_lag",
                                       "extra_dead_time"};
  plant::LoopModel truth = test::believed_model();
  truth.controller.pid.gains = {.kp = 0.15, .ki = 0.08};
  truth.process_effects = {
      {"oscillatory_process", {{"damping", 0.35}, {"natural_frequency", 0.7}}}};
  const test::Named named = test::named_among(names, truth);
  CHECK(named.first == "oscillatory_process");
  CHECK(named.lead_nats > 6.0);
  REQUIRE(named.corrected.process_effects.size() == 1);
  const auto& found = named.corrected.process_effects[0].parameters;
  CHECK(found.at("damping") == Approx(0.35).epsilon(0.1));
  CHECK(found.at("natural_frequency") == Approx(0.7).epsilon(0.05));
  truth.process_effects = {{"extra_lag", {{"time_constant", 2.0}}}};
  CHECK(test::named_among(names, truth).first == "extra_lag");
}

}  // namespace oscillatory_process_test
