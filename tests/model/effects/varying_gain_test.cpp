// SPDX-License-Identifier: Apache-2.0
#include "model/effects/varying_gain/varying_gain.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "tests/model/effects/search_support.hpp"

namespace varying_gain_test {

using namespace loopwarden;
using effects::VaryingGain;

namespace {

const std::vector<std::string> kNames{"varying_gain", "gain_change", "drift", "step_disturbance"};

}  // namespace

TEST_CASE("the factor passes through its points, smoothly, and never beyond its neighbours",
          "[effects][varying_gain]") {
  const VaryingGain gain(
      {.points = {{{10.0, 1.0}, {30.0, 0.6}, {40.0, 0.55}, {80.0, 1.3}}}, .point_count = 4});
  CHECK(gain.factor(-5.0) == 1.0);
  CHECK(gain.factor(10.0) == 1.0);
  CHECK(gain.factor(30.0) == Approx(0.6));
  CHECK(gain.factor(40.0) == Approx(0.55));
  CHECK(gain.factor(1e6) == 1.3);
  double last_slope = 0.0;
  for (double t = 5.0; t < 85.0; t += 0.01) {
    const double slope = (gain.factor(t + 0.01) - gain.factor(t)) / 0.01;
    REQUIRE(std::abs(slope - last_slope) < 5e-4);  // no corner
    last_slope = slope;
    if (t < 40.0 - 0.02) CHECK(slope <= 1e-9);
    if (t > 40.0) CHECK(slope >= -1e-9);
  }
  // Between two points with level ends, a cubic is at half height in the middle.
  const VaryingGain plain({.points = {{{0.0, 1.0}, {10.0, 2.0}}}, .point_count = 2});
  CHECK(plain.factor(5.0) == Approx(1.5));
}

TEST_CASE("the flow is multiplied, and severity fades the factor in", "[effects][varying_gain]") {
  VaryingGain gain({.points = {{{0.0, 1.0}, {10.0, 2.0}}}, .point_count = 2});
  CHECK(gain.reset(4.0) == 4.0);
  CHECK(gain.step(4.0, 20.0) == Approx(8.0));
  gain.set_severity(0.25);
  CHECK(gain.step(4.0, 20.0) == Approx(5.0));
  gain.set_severity(0.0);
  CHECK(gain.step(4.0, 20.0) == 4.0);
}

TEST_CASE("tables that fall in time or have zero factors are refused", "[effects][varying_gain]") {
  const auto complaint = [](std::vector<std::pair<double, double>> table) {
    effects::EffectSpec spec{"varying_gain"};
    spec.table = std::move(table);
    effects::check_effect(spec, effects::Block::process, {});
  };
  CHECK_NOTHROW(complaint({{0.0, 1.0}, {5.0, 2.0}}));
  CHECK_THROWS_WITH(complaint({{0.0, 1.0}}), "table must have 2 to 12 points (got 1)");
  CHECK_THROWS_WITH(complaint({{0.0, 1.0}, {0.0, 2.0}}),
                    "times in the table must rise (see point 2)");
  CHECK_THROWS_WITH(complaint({{0.0, 1.0}, {5.0, 0.0}}),
                    "factors in the table must be above 0 (see point 2)");
}

TEST_CASE("a gain that sags is found, and a constant one, a drift and a step keep their names",
          "[effects][varying_gain]") {
  plant::LoopModel truth = test::believed_model();
  effects::EffectSpec sags{"varying_gain"};
  sags.table = {{20.0, 1.0}, {90.0, 0.65}};
  truth.process_effects = {sags};
  const test::Named named = test::named_among(kNames, truth);
  CHECK(named.first == "varying_gain");
  CHECK(named.lead_nats > 6.0);
  truth.process_effects = {{"gain_change", {{"factor", 0.75}}}};
  CHECK(test::named_among(kNames, truth).first == "gain_change");
  truth.process_effects.clear();
  truth.transmitter_effects = {{"drift", {{"rate", 0.006}}}};
  CHECK(test::named_among(kNames, truth).first == "drift");
  truth.transmitter_effects.clear();
  truth.disturbances = {{"step_disturbance", {{"size", 0.5}, {"time", 50.0}}}};
  CHECK(test::named_among(kNames, truth).first == "step_disturbance");
}

}  // namespace varying_gain_test
