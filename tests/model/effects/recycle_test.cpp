// SPDX-License-Identifier: Apache-2.0
#include "model/effects/recycle/recycle.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "tests/model/effects/search_support.hpp"

namespace recycle_test {

using namespace loopwarden;

TEST_CASE("a step rises in stairs, each a share of the one before, to the whole",
          "[effects][recycle]") {
  effects::Recycle way(0.4, 2.0, 0.0, 0.1);
  way.reset(1.0);
  CHECK(way.step(1.0) == Approx(1.0));
  double x = 0.0;
  double left = 0.6;  // of the step of 1
  for (int stair = 0; stair < 4; ++stair) {
    for (int k = 0; k < 20; ++k) {
      x = way.step(2.0);
      CHECK(x == Approx(1.0 + left));
    }
    left = 0.6 + 0.4 * left;
  }
  for (int k = 0; k < 400; ++k) x = way.step(2.0);
  CHECK(x == Approx(2.0).margin(1e-6));
  way.set_severity(0.0);
  CHECK(way.step(3.0) == 3.0);
}

TEST_CASE("recycled material is also late by the lag", "[effects][recycle]") {
  effects::Recycle way(0.5, 1.0, 3.0, 0.1);
  way.reset(0.0);
  double x = 0.0;
  for (int k = 0; k < 10; ++k) x = way.step(1.0);
  CHECK(x == Approx(0.5));
  // The first stair through a lag of 3 s, 3 s after its beginning.
  double lagged = 0.0;
  const double keep = std::exp(-0.1 / 3.0);
  for (int k = 0; k < 10; ++k) {
    lagged = keep * lagged + (1.0 - keep) * 0.5;
    x = way.step(1.0);
  }
  CHECK(x == Approx(0.5 + 0.5 * lagged).epsilon(0.01));
}

TEST_CASE("a recycle is found with share and delay, and is no lag", "[effects][recycle]") {
  plant::LoopModel truth = test::believed_model();
  truth.process_effects = {{"recycle", {{"share", 0.35}, {"delay", 18.0}}}};
  const test::Named named =
      test::named_among({"recycle", "extra_lag", "extra_dead_time", "gain_change"}, truth);
  CHECK(named.first == "recycle");
  CHECK(named.lead_nats > 20.0);
  REQUIRE(named.corrected.process_effects.size() == 1);
  const effects::EffectSpec& spec = named.corrected.process_effects[0];
  CHECK(spec.parameters.at("share") == Approx(0.35).epsilon(0.1));
  CHECK(spec.parameters.at("delay") == Approx(18.0).epsilon(0.05));
}

}  // namespace recycle_test
