// SPDX-License-Identifier: Apache-2.0
#include "model/effects/inverse_response/inverse_response.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "tests/model/effects/search_support.hpp"

namespace inverse_response_test {

using namespace loopwarden;

TEST_CASE("a step of CO moves PV by zero time over lag the wrong way, then as by two opposing lags",
          "[effects][inverse_response]") {
  constexpr double kZero = 1.5;  // s
  plant::LoopModel model = test::believed_model();
  model.sample_time_s = 0.01;
  model.process = {.gain = 2.0, .time_constant_s = 3.0, .dead_time_s = 0.0};
  model.transmitter = {.low = -100.0, .high = 100.0};
  model.process_effects = {{"inverse_response", {{"zero_time", kZero}}}};
  plant::Plant plant(model, 1);
  plant.reset(2.0);
  CHECK(plant.process_variable() == Approx(4.0));
  for (int k = 1; k <= 2000; ++k) {
    const double pv = plant.step(3.0);
    // K (1 - Z p) / (T p + 1) is K (1 + Z/T) / (T p + 1) - K Z/T.
    const double t = 0.01 * k;
    const double exact =
        4.0 + 2.0 * ((1.0 + kZero / 3.0) * (1.0 - std::exp(-t / 3.0)) - kZero / 3.0);
    REQUIRE(pv == Approx(exact).margin(0.005));
  }
}

TEST_CASE("with a lag it is two lags that work against each other", "[effects][inverse_response]") {
  constexpr double kWeight = 0.8;  // of the opposing path
  constexpr double kSlow = 3.0;    // s
  constexpr double kFast = 0.6;    // s
  plant::LoopModel model = test::believed_model();
  model.sample_time_s = 0.01;
  model.process = {.gain = 2.0, .time_constant_s = kSlow, .dead_time_s = 0.0};
  model.transmitter = {.low = -100.0, .high = 100.0};
  model.process_effects = {
      {"inverse_response",
       {{"zero_time", kWeight * kSlow - (1.0 + kWeight) * kFast}, {"lag", kFast}}}};
  plant::Plant plant(model, 1);
  plant.reset(2.0);
  double lowest = 4.0;
  for (int k = 1; k <= 2000; ++k) {
    const double pv = plant.step(3.0);
    const double t = 0.01 * k;
    const double exact = 4.0 + 2.0 * ((1.0 + kWeight) * (1.0 - std::exp(-t / kSlow)) -
                                      kWeight * (1.0 - std::exp(-t / kFast)));
    REQUIRE(pv == Approx(exact).margin(0.01));
    lowest = std::min(lowest, pv);
  }
  CHECK(lowest < 3.7);
}

TEST_CASE("a zero has no effect on a loop at rest, and severity scales it",
          "[effects][inverse_response]") {
  effects::InverseResponse zero(2.0, 0.0, 0.1);
  CHECK(zero.reset(5.0) == 5.0);
  CHECK(zero.step(5.0) == 5.0);
  CHECK(zero.step(5.5) == Approx(5.5 - 20.0 * 0.5));
  CHECK(zero.step(5.5) == 5.5);
  zero.set_severity(0.5);
  CHECK(zero.step(6.0) == Approx(6.0 - 10.0 * 0.5));
  zero.set_severity(0.0);
  CHECK(zero.step(9.0) == 9.0);
}

TEST_CASE("inverse response is found in its size, and dead time stays dead time",
          "[effects][inverse_response]") {
  const std::vector<std::string> names{"inverse_response", "extra_dead_time", "extra_lag"};
  plant::LoopModel truth = test::believed_model();
  truth.process_effects = {{"inverse_response", {{"zero_time", 0.8}}}};
  const test::Named named = test::named_among(names, truth);
  CHECK(named.first == "inverse_response");
  CHECK(named.lead_nats > 6.0);
  REQUIRE(named.corrected.process_effects.size() == 1);
  CHECK(named.corrected.process_effects[0].parameters.at("zero_time") == Approx(0.8).epsilon(0.1));
  truth.process_effects = {{"extra_dead_time", {{"seconds", 0.9}}}};
  CHECK(test::named_among(names, truth).first == "extra_dead_time");
}

}  // namespace inverse_response_test
