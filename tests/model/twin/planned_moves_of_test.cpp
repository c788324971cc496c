// SPDX-License-Identifier: Apache-2.0
#include "model/twin/planned_moves_of.hpp"

#include <catch2/catch.hpp>

namespace planned_moves_of_test {

using namespace loopwarden;
using namespace loopwarden::twin;

TEST_CASE("planned moves take process and load from the twin", "[commission][planned_moves]") {
  plant::LoopModel twin;
  twin.process = {
      .gain = 1.5, .time_constant_s = 4.0, .dead_time_s = 2.0, .second_time_constant_s = 1.0};
  twin.disturbances = {{.name = "random_load", .parameters = {{"intensity", 0.02}}}};
  auto settings = planned_moves_of(twin);
  REQUIRE(settings);
  CHECK(settings->gain == 1.5);
  CHECK(settings->time_constant_s == 4.5);
  CHECK(settings->dead_time_s == 2.5);
  CHECK(settings->load == 0.02);
  twin.process.kind = plant::ProcessKind::integrating;
  CHECK_FALSE(planned_moves_of(twin));
}

TEST_CASE("planned moves take s and j from the explanation of an alarm",
          "[commission][planned_moves]") {
  const auto stick = stick_of({{"s", 0.8}, {"j", 0.3}}, {{"s", {0.7, 0.9}}}, 0.7, {"leakage"});
  REQUIRE(stick);
  control::PlannedMovesSettings settings;
  set_stick(settings, *stick);
  CHECK(settings.s == 0.8);
  CHECK(settings.s_low == 0.7);
  CHECK(settings.s_high == 0.9);
  CHECK(settings.j == 0.3);
  CHECK(settings.j_high == 0.0);
  CHECK(known_well(*stick));
  CHECK_FALSE(known_well(*stick_of({{"s", 0.8}, {"j", 0.3}}, {{"s", {0.4, 0.81}}}, 0.9, {})));
  CHECK_FALSE(known_well(*stick_of({{"s", 0.8}, {"j", 0.3}}, {}, 0.9, {})));
  CHECK_FALSE(stick_of({{"deadband", 0.8}}, {}, 0.9, {}));
  CHECK(stick_of({{"s", 0.8}, {"j", 0.9}}, {}, 0.9, {})->j == 0.8);
}

TEST_CASE("a valve that may also have backlash gets no moves; an unsure stick does not act",
          "[commission][planned_moves]") {
  const std::string name = GENERATE("backlash", "hysteresis");
  CHECK_FALSE(stick_of({{"s", 0.8}, {"j", 0.3}}, {{"s", {0.7, 0.9}}}, 0.95, {"leakage", name}));
  CHECK_FALSE(known_well(*stick_of({{"s", 0.8}, {"j", 0.3}}, {{"s", {0.7, 0.9}}}, 0.69, {})));
}

}  // namespace planned_moves_of_test
