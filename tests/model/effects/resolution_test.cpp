// SPDX-License-Identifier: Apache-2.0
#include "model/effects/resolution/resolution.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <set>

#include "tests/model/effects/search_support.hpp"

namespace resolution_test {

using namespace loopwarden;

TEST_CASE("the stem rests at whole steps from the lower end, never more than half a step off",
          "[effects][resolution]") {
  effects::Resolution valve(0.8, 4.0);
  std::set<long> places;
  for (int i = 0; i <= 1600; ++i) {
    const double u = 4.0 + 0.01 * i;
    const double x = valve.step(u);
    const double steps = (x - 4.0) / 0.8;
    CHECK(std::abs(steps - std::round(steps)) < 1e-9);
    CHECK(std::abs(x - u) <= 0.4 + 1e-9);
    CHECK(valve.step(u) == x);  // the same up and down
    places.insert(std::lround(steps));
  }
  CHECK(places.size() == 21);
  CHECK(valve.reset(5.3) == Approx(5.6));
}

TEST_CASE("a step of size zero is no step, and severity scales it", "[effects][resolution]") {
  effects::Resolution fine(0.0, 0.0);
  CHECK(fine.step(3.217) == 3.217);
  effects::Resolution valve(1.0, 0.0);
  valve.set_severity(0.5);
  CHECK(valve.step(3.3) == Approx(3.5));
  valve.set_severity(0.0);
  CHECK(valve.step(3.3) == 3.3);
}

TEST_CASE("a coarse valve is found in its step, no stiction in its place",
          "[effects][resolution]") {
  plant::LoopModel truth = test::believed_model();
  truth.valve_effects = {{"resolution", {{"step", 0.7}}}};
  const test::Named named =
      test::named_among({"resolution", "stiction", "backlash", "gain_change"}, truth);
  CHECK(named.first == "resolution");
  CHECK(named.lead_nats > 6.0);
  bool found = false;
  for (const effects::EffectSpec& spec : named.corrected.valve_effects) {
    if (spec.name != "resolution") continue;
    found = true;
    CHECK(spec.parameters.at("step") == Approx(0.7).epsilon(0.01));
  }
  CHECK(found);
}

TEST_CASE("backlash is named backlash in a model with a coarse valve", "[effects][resolution]") {
  plant::LoopModel truth = test::believed_model();
  truth.valve_effects = {{"backlash", {{"deadband", 0.6}}}};
  CHECK(test::named_among({"resolution", "backlash"}, truth).first == "backlash");
}

}  // namespace resolution_test
