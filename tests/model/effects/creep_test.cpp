// SPDX-License-Identifier: Apache-2.0
#include "model/effects/creep/creep.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "tests/model/effects/search_support.hpp"

namespace creep_test {

using namespace loopwarden;

TEST_CASE("all of a move except the amount arrives at once, and the amount arrives late",
          "[effects][creep]") {
  effects::Creep valve(0.5, 10.0, 0.1);
  valve.reset(3.0);
  CHECK(valve.step(5.0) == Approx(4.5));
  CHECK(valve.limited());
  double x = 0.0;
  for (int k = 0; k < 100; ++k) x = valve.step(5.0);
  CHECK(x == Approx(5.0 - 0.5 * std::exp(-1.0)));
  CHECK_FALSE(valve.limited());
  for (int k = 0; k < 2000; ++k) x = valve.step(5.0);
  CHECK(x == Approx(5.0).margin(1e-6));
  // A small move arrives late as a whole.
  CHECK(valve.step(5.3) == Approx(5.0).margin(1e-6));
  valve.set_severity(0.0);
  CHECK(valve.step(5.6) == 5.6);
}

TEST_CASE("creep is found with amount and time, and is no lag", "[effects][creep]") {
  plant::LoopModel truth = test::believed_model();
  truth.valve_effects = {{"creep", {{"amount", 0.4}, {"time_constant", 9.0}}}};
  const test::Named named =
      test::named_among({"creep", "extra_lag", "backlash", "gain_change"}, truth);
  CHECK(named.first == "creep");
  CHECK(named.lead_nats > 6.0);
  for (const effects::EffectSpec& spec : named.corrected.valve_effects) {
    if (spec.name != "creep") continue;
    CHECK(spec.parameters.at("amount") == Approx(0.4).epsilon(0.15));
    CHECK(spec.parameters.at("time_constant") == Approx(9.0).epsilon(0.2));
  }
  truth.valve_effects.clear();
  truth.transmitter_effects = {{"extra_lag", {{"time_constant", 3.0}}}};
  CHECK(test::named_among({"creep", "extra_lag"}, truth).first == "extra_lag");
}

}  // namespace creep_test
