// SPDX-License-Identifier: Apache-2.0
#include "model/effects/square_disturbance/square_disturbance.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>
#include <vector>

#include "tests/model/effects/search_support.hpp"

namespace square_disturbance_test {

using namespace loopwarden;
using std::numbers::pi;

namespace {

const std::vector<std::string> kNames{"square_disturbance", "oscillating_disturbance",
                                      "step_disturbance"};

}  // namespace

TEST_CASE("it has the sine's sign, and its Fourier series", "[effects][square_disturbance]") {
  effects::SquareDisturbance square(0.3, 20.0, 0.7, 0.005);
  double first = 0.0;  // of the harmonics, over whole periods
  double second = 0.0;
  double third = 0.0;
  constexpr int kSamples = 20'000;
  for (int k = 0; k < kSamples; ++k) {
    const double t = 100.0 * (k + 0.5) / kSamples;
    const double angle = 2.0 * pi * t / 20.0 + 0.7;
    const double y = square.step(5.0, t) - 5.0;
    REQUIRE(std::abs(y) <= 0.3 + 1e-9);
    if (std::abs(std::sin(angle)) > 2e-3) {  // no edge in this sample
      REQUIRE(y == Approx(std::sin(angle) > 0.0 ? 0.3 : -0.3));
    }
    first += 2.0 * y * std::sin(angle) / kSamples;
    second += 2.0 * y * std::sin(2.0 * angle) / kSamples;
    third += 2.0 * y * std::sin(3.0 * angle) / kSamples;
  }
  CHECK(first == Approx(4.0 / pi * 0.3).epsilon(1e-3));
  CHECK(second == Approx(0.0).margin(1e-3));
  CHECK(third == Approx(4.0 / (3.0 * pi) * 0.3).epsilon(1e-2));
}

TEST_CASE("a square is found with period and phase, a sine stays a sine",
          "[effects][square_disturbance]") {
  plant::LoopModel truth = test::believed_model();
  for (const double phase : {0.4, 2.0, -1.2}) {
    truth.disturbances = {
        {"square_disturbance", {{"amplitude", 0.25}, {"period", 22.0}, {"phase", phase}}}};
    const test::Named named = test::named_among(kNames, truth);
    CAPTURE(phase);
    CHECK(named.first == "square_disturbance");
    CHECK(named.lead_nats > 6.0);
    REQUIRE(named.corrected.disturbances.size() == 1);
    const auto& found = named.corrected.disturbances[0].parameters;
    CHECK(found.at("amplitude") == Approx(0.25).epsilon(0.1));
    CHECK(found.at("period") == Approx(22.0).epsilon(0.01));
    CHECK(std::remainder(found.at("phase") - phase, 2.0 * pi) == Approx(0.0).margin(0.15));
  }
  truth.disturbances = {{"oscillating_disturbance", {{"amplitude", 0.25}, {"period", 22.0}}}};
  CHECK(test::named_among(kNames, truth).first == "oscillating_disturbance");
}

}  // namespace square_disturbance_test
