// SPDX-License-Identifier: Apache-2.0
#include "model/effects/spikes/spikes.hpp"

#include <catch2/catch.hpp>
#include <cstddef>

#include "model/gap/workflow.hpp"
#include "tests/model/gap/gap_support.hpp"

namespace spikes_test {

using namespace loopwarden;

TEST_CASE("a share of the samples is off by the size, to both sides", "[effects][spikes]") {
  effects::Spikes reading(0.1, 2.0, 7);
  CHECK(reading.reset(5.0) == 5.0);
  std::size_t up = 0;
  std::size_t down = 0;
  for (int k = 0; k < 10000; ++k) {
    const double y = reading.step(5.0);
    if (y == 7.0) {
      ++up;
    } else if (y == 3.0) {
      ++down;
    } else {
      CHECK(y == 5.0);
    }
  }
  CHECK(up == Approx(500).margin(70));
  CHECK(down == Approx(500).margin(70));
}

TEST_CASE("spikes are named and skipped, and are the only name", "[effects][spikes]") {
  plant::LoopModel truth = test::believed_model();
  truth.transmitter_effects = {{"spikes", {{"share", 0.02}, {"size", 1.5}}}};
  const gap::Result result =
      gap::find_gap(test::record_of(truth, 90.0), test::believed_model(),
                    {.search = {.several = false}}, test::serial, [](double) {});
  INFO(result.sentence);
  CHECK(result.outcome == gap::Outcome::missing_effect);
  REQUIRE(result.effects.size() == 1);
  CHECK(result.effects[0].spec.name == "spikes");
  CHECK(result.effects[0].spec.parameters.at("share") == Approx(0.02).epsilon(0.3));
  CHECK(result.effects[0].spec.parameters.at("size") == Approx(1.5).epsilon(0.05));
  // A free run has no spikes.
  CHECK(result.after.rmse < 2.0 * result.floor.transmitter_rmse);
}

}  // namespace spikes_test
