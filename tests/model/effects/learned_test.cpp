// SPDX-License-Identifier: Apache-2.0
#include "model/effects/learned/learned.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <string>
#include <vector>

#include "model/effects/first_order_lag.hpp"
#include "tests/model/effects/search_support.hpp"

namespace learned_test {

using namespace loopwarden;
using effects::EffectSpec;

const effects::EffectContext kContext{.sample_time_s = 0.1, .output_low = 0.0, .output_high = 10.0};

std::string complaint(EffectSpec spec) {
  try {
    effects::check_effect(spec, effects::Block::valve, kContext);
  } catch (const effects::EffectError& e) {
    return e.key() + ": " + e.what();
  }
  return {};
}

TEST_CASE("a static form is straight between its points and keeps its offset beyond",
          "[effects][learned]") {
  effects::LearnedCurve curve({{2.0, 2.0}, {4.0, 3.0}, {6.0, 7.0}});
  CHECK(curve.step(1.0) == 1.0);
  CHECK(curve.step(3.0) == Approx(2.5));
  CHECK(curve.step(5.0) == Approx(5.0));
  CHECK(curve.step(9.0) == Approx(10.0));
  curve.set_severity(0.5);
  CHECK(curve.step(4.0) == Approx(3.5));
}

TEST_CASE("a play of one threshold is a backlash, and weights share the move",
          "[effects][learned]") {
  effects::LearnedPlay play({{0.5, 1.0}}, 0.0);
  CHECK(play.reset(3.0) == 3.0);
  CHECK(play.step(5.0) == 4.5);
  CHECK(play.step(4.2) == 4.5);
  CHECK(play.step(3.0) == 3.5);
  effects::LearnedPlay shared({{0.0, 0.25}, {0.5, 0.75}}, 0.2);
  CHECK(shared.reset(4.0) == Approx(4.2));
  CHECK(shared.step(6.0) == Approx(0.25 * 6.0 + 0.75 * 5.5 + 0.2));
}

TEST_CASE("a gain profile follows the time or the opening", "[effects][learned]") {
  effects::LearnedGain by_time({{0.0, 1.0}, {10.0, 0.5}}, true);
  CHECK(by_time.reset(4.0) == 4.0);
  CHECK(by_time.step(4.0, 5.0) == Approx(3.0));
  CHECK(by_time.step(4.0, 50.0) == Approx(2.0));
  effects::LearnedGain by_opening({{2.0, 1.0}, {4.0, 2.0}}, false);
  CHECK(by_opening.step(3.0, 99.0) == Approx(4.5));
}

TEST_CASE("a transfer function answers as its lags do", "[effects][learned]") {
  // 1/(2p + 1), and 0.3 + 0.7/(2p + 1)^2 = (1 + 1.2p + 1.2p^2)/(1 + 4p + 4p^2).
  effects::LearnedFilter one({1.0}, {1.0, 2.0}, 0.1);
  effects::LearnedFilter two({1.0, 1.2, 1.2}, {1.0, 4.0, 4.0}, 0.1);
  effects::FirstOrderLag lag(2.0, 0.1);
  CHECK(one.reset(3.0) == Approx(3.0));
  CHECK(two.reset(3.0) == Approx(3.0));
  lag.reset(3.0);
  for (int k = 1; k < 200; ++k) {
    const double u = k < 100 ? 5.0 : 4.0;
    REQUIRE(one.step(u) == Approx(lag.step(u)));
    const double y = two.step(u);
    if (k < 100) {
      const double t = 0.1 * k / 2.0;
      REQUIRE(y == Approx(3.0 + 2.0 * (0.3 + 0.7 * (1.0 - std::exp(-t) * (1.0 + t)))));
    }
  }
}

TEST_CASE("impossible values of a form are refused by key", "[effects][learned]") {
  const auto with = [](const char* form, effects::Points table) {
    return EffectSpec{"learned", {}, {{"form", form}}, std::move(table)};
  };
  CHECK(complaint(with("static", {{1.0, 2.0}, {2.0, 1.0}})).empty());
  CHECK(complaint(with("static", {})).find("table: table must have 1 to 64") == 0);
  CHECK(complaint(with("static", {{2.0, 2.0}, {2.0, 1.0}})).find("table must rise") !=
        std::string::npos);
  CHECK(complaint(with("hysteretic", {{-0.1, 1.0}})).find("thresholds: ") == 0);
  CHECK(complaint(with("dynamic", {{1.0, 1.0}})).find("denominator: ") == 0);
  CHECK(complaint(with("dynamic", {{1.0, 1.0}, {0.0, -2.0}})).find("does not die away") !=
        std::string::npos);
  CHECK(complaint(with("dynamic", {{1.0, 1.0}, {0.0, 2.0}, {1.0, 0.0}})).find("numerator: ") == 0);
  CHECK(complaint(with("dynamic", {{1.0, 1.0}, {0.5, 2.0}})).empty());
  CHECK(complaint(with("straight", {{1.0, 1.0}})).find("form") != std::string::npos);
}

}  // namespace learned_test
