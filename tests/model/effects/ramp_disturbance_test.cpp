// SPDX-License-Identifier: Apache-2.0
#include "model/effects/ramp_disturbance/ramp_disturbance.hpp"

#include <catch2/catch.hpp>
#include <vector>

#include "tests/model/effects/search_support.hpp"

namespace ramp_disturbance_test {

using namespace loopwarden;

namespace {

const std::vector<std::string> kNames{"ramp_disturbance", "step_disturbance", "drift",
                                      "output_bias"};

}  // namespace

TEST_CASE("zero before the ramp, its part during it, all of it from its end on",
          "[effects][ramp_disturbance]") {
  effects::RampDisturbance ramp(-0.8, 100.0, 140.0);
  CHECK(ramp.reset(5.0) == 5.0);
  CHECK(ramp.step(5.0, 99.9) == 5.0);
  CHECK(ramp.step(5.0, 110.0) == Approx(4.8));
  CHECK(ramp.step(6.0, 130.0) == Approx(5.4));
  CHECK(ramp.step(5.0, 140.0) == Approx(4.2));
  CHECK(ramp.step(5.0, 1e6) == Approx(4.2));
  ramp.set_severity(0.25);
  CHECK(ramp.step(5.0, 1e6) == Approx(4.8));
}

TEST_CASE("a ramp that ends before it begins is refused", "[effects][ramp_disturbance]") {
  const auto ramp = [](double from, double to) {
    effects::check_effect({"ramp_disturbance", {{"size", 1.0}, {"from", from}, {"to", to}}},
                          effects::Block::disturbance, {});
  };
  CHECK_NOTHROW(ramp(-5.0, 20.0));
  CHECK_THROWS_WITH(ramp(20.0, 20.0), "to must be after from = 20 s (got 20)");
}

TEST_CASE("a ramp is found with its two moments, a step and a drift keep their names",
          "[effects][ramp_disturbance]") {
  plant::LoopModel truth = test::believed_model();
  truth.disturbances = {{"ramp_disturbance", {{"size", 0.7}, {"from", 30.0}, {"to", 70.0}}}};
  const test::Named named = test::named_among(kNames, truth);
  CHECK(named.first == "ramp_disturbance");
  CHECK(named.lead_nats > 6.0);
  REQUIRE(named.corrected.disturbances.size() == 1);
  const auto& found = named.corrected.disturbances[0].parameters;
  CHECK(found.at("size") == Approx(0.7).epsilon(0.05));
  CHECK(found.at("from") == Approx(30.0).margin(3.0));
  CHECK(found.at("to") == Approx(70.0).margin(3.0));

  truth.disturbances = {{"step_disturbance", {{"size", 0.7}, {"time", 50.0}}}};
  CHECK(test::named_among(kNames, truth).first == "step_disturbance");
  truth.disturbances.clear();
  truth.transmitter_effects = {{"drift", {{"rate", 0.006}}}};
  CHECK(test::named_among(kNames, truth).first == "drift");
}

}  // namespace ramp_disturbance_test
