// SPDX-License-Identifier: Apache-2.0
#include "model/plant/plant.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "model/effects/catalogue.hpp"
#include "model/effects/backlash/backlash.hpp"
#include "model/effects/first_order_lag.hpp"
#include "model/effects/oscillating_disturbance/oscillating_disturbance.hpp"

namespace plant_test {

using namespace loopwarden;
using namespace loopwarden::plant;

namespace {

LoopModel plain() {
  LoopModel model;
  model.controller.pid.output_high = 10.0;
  model.process = {.gain = 1.2264, .time_constant_s = 1.69376, .dead_time_s = 2.6256};
  model.transmitter = {.low = 0.0, .high = 15.0};
  return model;
}

effects::EffectSpec effect(const char* name, std::map<std::string, double> parameters) {
  return {.name = name, .parameters = std::move(parameters)};
}

}  // namespace

TEST_CASE("PV at CO 0 is the process's level", "[plant]") {
  LoopModel model;
  model.process = {.gain = 2.0, .time_constant_s = 1.0, .level = 7.0};
  model.transmitter = {.low = -100.0, .high = 300.0};
  Plant plant(model, 1);
  plant.reset(0.0);
  CHECK(plant.process_variable() == Approx(7.0));
  plant.reset(10.0);
  CHECK(plant.process_variable() == Approx(27.0));
  for (int k = 0; k < 500; ++k) plant.step(20.0);
  CHECK(plant.process_variable() == Approx(47.0));
  CHECK(plant.output_for(17.0) == Approx(5.0));
}

TEST_CASE("a plant at rest stays at rest", "[plant][loop]") {
  Plant plant(plain(), 1);
  plant.reset(4.0);
  CHECK(plant.time_s() == 0.0);
  CHECK(plant.stem() == 4.0);
  CHECK(plant.process_variable() == Approx(4.0 * 1.2264));
  for (int k = 0; k < 100; ++k) REQUIRE(plant.step(4.0) == Approx(4.0 * 1.2264));
  CHECK(plant.time_s() == Approx(10.0));
}

TEST_CASE("the composed loop is its parts in a row", "[plant][loop]") {
  LoopModel model = plain();
  model.valve_effects = {effect("backlash", {{"deadband", 0.6}})};
  model.process_effects = {effect("gain_change", {{"factor", 0.8}}),
                           effect("extra_lag", {{"time_constant", 2.0}})};
  model.disturbances = {effect("oscillating_disturbance", {{"amplitude", 0.3}, {"period", 17.0}})};
  model.transmitter_effects = {effect("output_bias", {{"bias", 0.25}})};
  model.transmitter.resolution = 0.01;
  Plant plant(model, 1);
  plant.reset(5.0);

  effects::Backlash backlash(0.6);
  effects::FirstOrderLag lag(2.0, 0.1);
  Process process(model.process, 0.1);
  process.reset(lag.reset(0.8 * backlash.reset(5.0)));
  effects::OscillatingDisturbance sine(0.3, 17.0, 0.0);
  for (int k = 0; k < 400; ++k) {
    const double co = 5.0 + 2.0 * std::sin(0.02 * k);
    const double stem = backlash.step(co);
    // PV at sample k + 1 follows from CO held since sample k. Disturbances use the time of PV.
    const double true_pv = sine.step(process.step(lag.step(0.8 * stem)), 0.1 * (k + 1));
    const double pv = 0.01 * std::round((true_pv + 0.25) / 0.01);
    REQUIRE(plant.step(co) == Approx(pv).margin(1e-9));
    REQUIRE(plant.true_process_variable() == Approx(true_pv).margin(1e-9));
    REQUIRE(plant.stem() == Approx(stem));
  }
}

TEST_CASE("the stem is the travel, not the flow, also at rest", "[plant][loop]") {
  LoopModel model = plain();
  model.valve_effects = {effect("low_air_supply", {{"rate", 5.0}, {"travel_limit", 6.0}}),
                         effect("valve_characteristic", {})};
  model.valve_effects[1].options["curve"] = "butterfly";
  Plant plant(model, 1);
  plant.reset(8.0);
  CHECK(plant.stem() == Approx(6.0));
  plant.step(8.0);
  CHECK(plant.stem() == Approx(6.0));
  CHECK(plant.process_variable() ==
        Approx(1.2264 * 10.0 * (1.0 - std::cos(0.3 * std::numbers::pi))));
}

TEST_CASE("the output to start from gives the PV that is wanted", "[plant][loop]") {
  LoopModel model = plain();
  SECTION("linear") {}
  SECTION("through a characteristic and a gain") {
    model.valve_effects = {effect("valve_characteristic", {})};
    model.valve_effects[0].options["curve"] = "equal_percentage";
    model.process_effects = {effect("gain_change", {{"factor", 1.3}})};
  }
  SECTION("with a negative gain") {
    model.process.gain = -1.0;
    model.transmitter.low = -15.0;
    Plant plant(model, 1);
    CHECK(plant.output_for(-4.0) == Approx(4.0));
    return;
  }
  Plant plant(model, 1);
  plant.reset(plant.output_for(5.0));
  CHECK(plant.process_variable() == Approx(5.0));
  // A PV that can't be reached gives the end of the output's range.
  CHECK(plant.output_for(99.0) == Approx(10.0));
  CHECK(plant.output_for(-99.0) == Approx(0.0).margin(1e-9));
}

TEST_CASE("the calculation of the output leaves the plant unchanged", "[plant][loop]") {
  LoopModel model = plain();
  model.transmitter.noise = 0.1;
  Plant plant(model, 4);
  Plant other(model, 4);
  static_cast<void>(plant.output_for(5.0));
  for (int k = 0; k < 20; ++k) REQUIRE(plant.step(3.0) == other.step(3.0));
}

TEST_CASE("an integrating plant starts at the set point and keeps it", "[plant][loop]") {
  LoopModel model = plain();
  model.process = {.gain = 0.1, .dead_time_s = 0.5, .kind = ProcessKind::integrating};
  model.scenario.set_point = {{0.0, 7.0}};
  Plant plant(model, 1);
  const double co = plant.output_for(7.0);
  CHECK(co == 5.0);  // rests at any output: the middle of the range
  plant.reset(co);
  for (int k = 0; k < 50; ++k) REQUIRE(plant.step(co) == Approx(7.0));
  for (int k = 0; k < 50; ++k) plant.step(co + 1.0);
  CHECK(plant.step(co + 1.0) == Approx(7.0 + 0.1 * (5.1 - 0.5)));
}

TEST_CASE("scheduled faults begin and end", "[plant][loop]") {
  LoopModel model = plain();
  model.scenario.faults = {{.effect = effect("output_bias", {{"bias", 2.0}}),
                            .block = effects::Block::transmitter,
                            .schedule = {.from_s = 10.0, .to_s = 20.0, .ramp_s = 5.0}},
                           {.effect = effect("gain_change", {{"factor", 2.0}}),
                            .block = effects::Block::process,
                            .schedule = {.from_s = 1000.0}}};
  Plant plant(model, 1);
  plant.reset(4.0);
  for (int k = 1; k <= 300; ++k) {
    const double t = 0.1 * k;
    const double bias = t >= 20.0 - 1e-9 ? 0.0
                        : t < 10.0       ? 0.0
                                         : std::min(1.0, (t - 10.0) / 5.0) * 2.0;
    REQUIRE(plant.step(4.0) == Approx(4.0 * 1.2264 + bias).margin(1e-6));
    REQUIRE(plant.fault_severity() == Approx(bias / 2.0).margin(1e-6));
  }
}

TEST_CASE("a model that the catalogue refuses gives no plant", "[plant][loop]") {
  LoopModel model = plain();
  model.valve_effects = {effect("stiction", {{"s", 1.0}, {"j", 2.0}})};
  CHECK_THROWS_AS(Plant(model, 1), loopwarden::effects::EffectError);
  model.valve_effects = {effect("output_bias", {{"bias", 1.0}})};
  CHECK_THROWS_AS(Plant(model, 1), loopwarden::effects::EffectError);
  model.valve_effects.clear();
  model.scenario.faults = {{.effect = effect("backlash", {{"deadband", 1.0}}),
                            .block = effects::Block::controller,
                            .schedule = {}}};
  CHECK_THROWS_AS(Plant(model, 1), loopwarden::effects::EffectError);
}

TEST_CASE("two random effects are not the same noise", "[plant][loop]") {
  LoopModel model = plain();
  const effects::EffectSpec load =
      effect("random_load", {{"intensity", 0.1}, {"time_constant", 50.0}});
  model.disturbances = {load, load};
  Plant both(model, 1);
  model.disturbances = {load};
  Plant one(model, 1);
  both.reset(5.0);
  one.reset(5.0);
  int doubled = 0;
  for (int k = 0; k < 100; ++k) {
    const double single = one.step(5.0) - 5.0 * 1.2264;
    const double pair = both.step(5.0) - 5.0 * 1.2264;
    if (std::abs(pair - 2.0 * single) < 1e-9) ++doubled;
  }
  CHECK(doubled == 0);
}

}  // namespace plant_test
