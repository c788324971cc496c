// SPDX-License-Identifier: Apache-2.0
#include "model/effects/plugging/plugging.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "tests/model/effects/search_support.hpp"

namespace plugging_test {

using namespace loopwarden;

TEST_CASE("a step passes through a lag that has grown since the start", "[effects][plugging]") {
  for (const double at_s : {10.0, 100.0}) {
    effects::Plugging line(0.05, 0.01);
    line.reset(2.0);
    CHECK(line.step(2.0, at_s) == 2.0);
    const double lag_s = 0.05 * at_s;
    double y = 0.0;
    // A time so short that the lag hardly grows.
    for (int k = 1; k <= 10; ++k) y = line.step(3.0, at_s);
    CHECK(y == Approx(3.0 - std::exp(-0.1 / lag_s)));
  }
  effects::Plugging line(0.05, 0.1);
  line.reset(2.0);
  CHECK(line.step(3.0, 0.0) == 3.0);  // the line is free at first
  line.set_severity(0.0);
  CHECK(line.step(4.0, 500.0) == 4.0);
}

TEST_CASE("a line that plugs is found with its rate, and is no constant lag",
          "[effects][plugging]") {
  plant::LoopModel truth = test::believed_model();
  truth.transmitter_effects = {{"plugging", {{"rate", 0.03}}}};
  const test::Named named = test::named_among(
      {"plugging", "extra_lag", "extra_dead_time", "varying_gain", "gain_change"}, truth);
  CHECK(named.first == "plugging");
  CHECK(named.lead_nats > 20.0);
  REQUIRE(named.corrected.transmitter_effects.size() == 1);
  CHECK(named.corrected.transmitter_effects[0].parameters.at("rate") == Approx(0.03).epsilon(0.1));
}

}  // namespace plugging_test
