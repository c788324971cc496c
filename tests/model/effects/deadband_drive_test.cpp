// SPDX-License-Identifier: Apache-2.0
#include "model/effects/deadband_drive/deadband_drive.hpp"

#include <catch2/catch.hpp>
#include <limits>

#include "tests/model/effects/search_support.hpp"

namespace deadband_drive_test {

using namespace loopwarden;

TEST_CASE("a drive rests within its band, then moves all the way at its rate",
          "[effects][deadband_drive]") {
  effects::DeadbandDrive drive(1.0, 4.5, 0.5);
  CHECK(drive.reset(50.0) == 50.0);
  CHECK(drive.step(51.0) == 50.0);
  CHECK_FALSE(drive.moves());
  CHECK(drive.step(55.0) == Approx(52.25));
  CHECK(drive.moves());
  // It stops neither at the edge of the band, nor when the command has returned a little.
  CHECK(drive.step(54.5) == Approx(54.5));
  CHECK_FALSE(drive.moves());
  CHECK(drive.step(53.6) == Approx(54.5));
  CHECK(drive.step(53.4) == Approx(53.4));
  CHECK(drive.step(std::numeric_limits<double>::quiet_NaN()) == Approx(53.4));
}

TEST_CASE("a drive is found with band and rate, and its parts are listed with it",
          "[effects][deadband_drive]") {
  plant::LoopModel truth = test::believed_model();
  truth.valve_effects = {{"deadband_drive", {{"band", 0.5}, {"rate", 0.35}}}};
  const test::Named named = test::named_among(
      {"deadband_drive", "low_air_supply", "stiction", "backlash", "gain_change"}, truth);
  CHECK(named.first == "deadband_drive");
  CHECK(named.lead_nats > 6.0);
  for (const effects::EffectSpec& spec : named.corrected.valve_effects) {
    if (spec.name != "deadband_drive") continue;
    CHECK(spec.parameters.at("band") == Approx(0.5).epsilon(0.1));
    CHECK(spec.parameters.at("rate") == Approx(0.35).epsilon(0.1));
  }
  CHECK(effects::find_effect("deadband_drive")->made_of.size() == 2);
}

TEST_CASE("a valve that sticks is no drive", "[effects][deadband_drive]") {
  plant::LoopModel truth = test::believed_model();
  truth.valve_effects = {{"stiction", {{"s", 0.8}, {"j", 0.5}}}};
  CHECK(test::named_among({"deadband_drive", "stiction"}, truth).first == "stiction");
}

}  // namespace deadband_drive_test
