// SPDX-License-Identifier: Apache-2.0
#include "lab/calm_study/physical_plant.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "lab/calm_study/calm_study.hpp"

namespace physical_plant_test {

using namespace loopwarden;
using namespace loopwarden::lab;

namespace {

plant::LoopModel model() {
  plant::LoopModel m;
  m.sample_time_s = 0.1;
  m.process = {.gain = 1.5, .time_constant_s = 4.0, .dead_time_s = 2.0};
  m.transmitter = {.low = 0.0, .high = 15.0, .resolution = 0.0, .noise = 0.0};
  return m;
}

}  // namespace

TEST_CASE("a physical stem rests within its band, and jumps by j", "[calm][studies]") {
  const auto friction = GENERATE(PhysicalFriction::karnopp, PhysicalFriction::stribeck);
  PhysicalPlant plant(model(), {.friction = friction, .s = 0.8, .j = 0.5});
  plant.reset(5.0);
  double co = 5.0;
  double last = plant.stem();
  double jump = 0.0;
  while (co < 5.6) plant.step(co += 0.001);
  CHECK(plant.stem() == Approx(5.0).margin(0.01));  // (s + j)/2 breaks it loose
  while (co < 5.7) {
    plant.step(co += 0.001);
    jump += plant.stem() - last;
    last = plant.stem();
  }
  CHECK(jump == Approx(0.5).margin(0.15));
}

TEST_CASE("a physical loop answers with dead time, lag and gain", "[calm][studies]") {
  PhysicalPlant plant(model(), {.s = 0.002, .j = 0.001, .air_lag_s = 0.1});
  plant.reset(plant.output_for(6.0));
  CHECK(plant.true_process_variable() == Approx(6.0));
  const auto run = [&](double s) {
    for (int k = 0; k < static_cast<int>(std::lround(10.0 * s)); ++k) plant.step(5.0);
  };
  run(1.9);
  CHECK(plant.true_process_variable() == Approx(6.0).margin(0.01));
  run(4.3);
  CHECK((plant.true_process_variable() - 6.0) / 1.5 == Approx(1.0 - std::exp(-1.0)).margin(0.03));
  run(40.0);
  CHECK(plant.process_variable() == Approx(7.5).margin(0.01));
}

TEST_CASE("load and noise of a physical loop are the model's, the same for a seed",
          "[calm][studies]") {
  plant::LoopModel m = model();
  m.transmitter.noise = 0.02;
  m.disturbances = {{.name = "random_load", .parameters = {{"intensity", 0.05}}}};
  PhysicalPlant one(m, {.s = 0.5, .j = 0.2});
  PhysicalPlant same(m, {.s = 0.5, .j = 0.2});
  one.reset(5.0);
  same.reset(5.0);
  double noise = 0.0;
  double wandered = 0.0;
  double last = one.true_process_variable();
  for (int k = 0; k < 20000; ++k) {
    one.step(5.0);
    same.step(5.0);
    REQUIRE(one.process_variable() == same.process_variable());
    noise += std::pow(one.process_variable() - one.true_process_variable(), 2);
    wandered += std::pow(one.true_process_variable() - last, 2);
    last = one.true_process_variable();
  }
  CHECK(std::sqrt(noise / 20000.0) == Approx(0.02).epsilon(0.05));
  CHECK(std::sqrt(wandered / 2000.0) == Approx(0.05).epsilon(0.05));  // per root second
}

TEST_CASE("a study of physical friction drives another plant than the laws'", "[calm][studies]") {
  const StickyStudy study =
      study_sticky_loops(2, 5, Load::steady, "planned_moves, s", {}, Valve::physical);
  REQUIRE(study.rows.size() == 1);
  REQUIRE(study.rows.front().factors.size() == 2);
  for (const double factor : study.rows.front().factors) {
    CHECK(factor > 0.0);
    CHECK(factor < 10.0);
  }
  CHECK(study.rows.front().factors !=
        study_sticky_loops(2, 5, Load::steady, "planned_moves, s", {}).rows.front().factors);
}

}  // namespace physical_plant_test
