// SPDX-License-Identifier: Apache-2.0
#include "model/effects/clipped_measurement/clipped_measurement.hpp"

#include <algorithm>
#include <catch2/catch.hpp>

#include "model/effects/catalogue.hpp"
#include "tests/model/gap/gap_support.hpp"

namespace clipped_measurement_test {

using namespace loopwarden;

TEST_CASE("no reading is beyond the ends, and severity fades them in",
          "[effects][clipped_measurement]") {
  effects::ClippedMeasurement both(2.0, 5.0);
  CHECK(both.reset(1.0) == 2.0);
  CHECK(both.step(4.5) == 4.5);
  CHECK(both.step(7.0) == 5.0);
  // Exactly the limit, for any process value beyond it.
  CHECK(effects::ClippedMeasurement(0.0, 5.2).step(14.68) == 5.2);
  CHECK(effects::ClippedMeasurement(2.1, 5.2).step(-0.95) == 2.1);
  both.set_severity(0.5);
  CHECK(both.step(7.0) == Approx(6.0));
}

TEST_CASE("one limit is enough, at least one is required, and they must not cross",
          "[effects][clipped_measurement]") {
  const auto complaint = [](std::map<std::string, double> parameters) {
    effects::check_effect({"clipped_measurement", std::move(parameters)},
                          effects::Block::transmitter, {});
  };
  CHECK_NOTHROW(complaint({{"low", 2.0}}));
  CHECK_NOTHROW(complaint({{"high", 2.0}}));
  CHECK_THROWS_WITH(complaint({}), "effect 'clipped_measurement' needs low or high, or both");
  CHECK_THROWS_WITH(complaint({{"low", 3.0}, {"high", 3.0}}),
                    "high must be above low = 3 PV units (got 3)");
}

TEST_CASE("beyond the end the reading is exactly flat, though the transmitter has noise",
          "[effects][clipped_measurement]") {
  plant::LoopModel model = test::believed_model();
  model.transmitter.noise = 0.05;
  model.transmitter_effects = {{"clipped_measurement", {{"high", 5.0}}}};
  plant::Plant plant(model, 3);
  plant.reset(8.0);  // PV 8.8
  for (int k = 0; k < 100; ++k) CHECK(plant.step(8.0) == 5.0);
  double farthest = 0.0;
  for (int k = 0; k < 400; ++k) {
    const double pv = plant.step(2.0);
    if (k > 300) farthest = std::max(farthest, std::abs(pv - 2.2));
  }
  CHECK(farthest > 0.02);  // noise
  CHECK(farthest < 0.4);
}

}  // namespace clipped_measurement_test
