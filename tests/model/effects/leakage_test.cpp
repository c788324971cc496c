// SPDX-License-Identifier: Apache-2.0
#include "model/effects/leakage/leakage.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <string>
#include <vector>

#include "tests/model/effects/search_support.hpp"

namespace leakage_test {

using namespace loopwarden;

namespace {

test::Named named_in(const plant::LoopModel& truth) {
  return test::named_among({"leakage", "gain_change", "output_bias"}, truth);
}

}  // namespace

TEST_CASE("a shut valve passes the leak, an open one what it passed before", "[effects][leakage]") {
  effects::Leakage leak(0.5, 4.0, 20.0);
  CHECK(leak.step(4.0) == Approx(4.5));
  CHECK(leak.step(20.0) == Approx(20.0));
  // Two orifices in parallel: the seat, and the plug over the rest of the capacity.
  for (double x = 4.0; x <= 20.0; x += 0.25) {
    const double capacity = 16.0;
    const double plug = (x - 4.0) / capacity;  // share of the plug's capacity
    const double seat = 0.5 / capacity;
    CHECK(leak.step(x) == Approx(4.0 + capacity * (seat + plug * (1.0 - seat))));
  }
  leak.set_severity(0.5);
  CHECK(leak.step(4.0) == Approx(4.25));
  leak.set_severity(0.0);
  CHECK(leak.step(7.0) == 7.0);
}

TEST_CASE("the leak does not affect the stem", "[effects][leakage]") {
  plant::LoopModel model = test::believed_model();
  model.valve_effects = {{"leakage", {{"flow", 2.0}}}};
  plant::Plant plant(model, 1);
  plant.reset(3.0);
  CHECK(plant.stem() == 3.0);
  CHECK(plant.process_variable() == Approx(1.1 * (2.0 + 0.8 * 3.0)));
}

TEST_CASE("a leak of more than the whole flow is refused", "[effects][leakage]") {
  const effects::EffectContext context{.output_low = 4.0, .output_high = 20.0};
  CHECK_NOTHROW(
      effects::check_effect({"leakage", {{"flow", 16.0}}}, effects::Block::valve, context));
  CHECK_THROWS_WITH(
      effects::check_effect({"leakage", {{"flow", 16.1}}}, effects::Block::valve, context),
      "flow must be at most the output's span, 16 CO units (got 16.1)");
}

TEST_CASE("a large leak is found in its size, no gain and no bias in its place",
          "[effects][leakage]") {
  plant::LoopModel truth = test::believed_model();
  truth.valve_effects = {{"leakage", {{"flow", 1.6}}}};
  const test::Named named = named_in(truth);
  CHECK(named.first == "leakage");
  CHECK(named.effect.parameters.at("flow") == Approx(1.6).epsilon(0.05));
  CHECK(named.lead_nats > 6.0);
}

TEST_CASE("a bias stays a bias and a gain a gain, though a leak also explains a little bias",
          "[effects][leakage]") {
  plant::LoopModel truth = test::believed_model();
  truth.transmitter_effects = {{"output_bias", {{"bias", 0.2}}}};
  CHECK(named_in(truth).first == "output_bias");
  truth.transmitter_effects.clear();
  truth.process.gain *= 0.8;
  CHECK(named_in(truth).first == "gain_change");
}

}  // namespace leakage_test
