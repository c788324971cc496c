// SPDX-License-Identifier: Apache-2.0
#include "model/effects/stiction/stiction_closing.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "model/effects/catalogue.hpp"
#include "model/plant/plant.hpp"
#include "model/effects/stiction/stiction_choudhury.hpp"

namespace stiction_closing_test {

using namespace loopwarden;
using effects::StictionClosing;

TEST_CASE("the same friction both ways is the one-way law", "[plant][stiction]") {
  StictionClosing both({1.2, 0.5}, {1.2, 0.5});
  effects::StictionChoudhury one({1.2, 0.5});
  both.reset(5.0);
  one.reset(5.0);
  for (int k = 0; k < 2000; ++k) {
    const double u = 5.0 + 2.0 * std::sin(0.031 * k) + 0.8 * std::sin(0.11 * k);
    REQUIRE(both.step(u) == one.step(u));
  }
}

TEST_CASE("each direction has its own friction and continues from the other's end",
          "[plant][stiction]") {
  // Opening: fs 0.7, fd 0.5. Closing: fs 1.1, fd 0.6.
  StictionClosing valve({1.2, 0.2}, {1.7, 0.5});
  valve.reset(5.0);
  double u = 5.0;
  for (; u < 8.0; u += 0.001) valve.step(u);
  CHECK(valve.step(u) == Approx(u - 0.5));
  const double turned_down = u;
  double x = u - 0.5;
  const double held = x;
  while (x == Approx(held).margin(1e-9)) x = valve.step(u -= 0.001);
  CHECK(turned_down - u == Approx(1.1 + 0.5).margin(0.005));
  CHECK(held - x == Approx(1.1 - 0.6).margin(0.005));  // j_closing
  for (; u > 4.0; u -= 0.001) x = valve.step(u);
  CHECK(x == Approx(u + 0.001 + 0.6).margin(0.002));
  const double turned_up = u;
  const double low = x;
  while (x == Approx(low).margin(1e-9)) x = valve.step(u += 0.001);
  CHECK(u - turned_up == Approx(0.7 + 0.6).margin(0.005));
  CHECK(x - low == Approx(0.7 - 0.5).margin(0.005));  // j
}

TEST_CASE("closing values that are missing equal those of opening, and only one law has them",
          "[plant][stiction]") {
  const effects::EffectContext context{.output_high = 10.0};
  const auto stepped = [&](const effects::EffectSpec& spec) {
    effects::check_effect(spec, effects::Block::valve, context);
    effects::Effect effect = effects::make_effect(spec, context);
    effect.reset(5.0);
    double sum = 0.0;
    for (int k = 0; k < 500; ++k) sum += effect.step(5.0 + 3.0 * std::sin(0.05 * k), 0.1 * k);
    return sum;
  };
  const double plain = stepped({"stiction", {{"s", 1.0}, {"j", 0.4}}});
  CHECK(stepped({"stiction", {{"s", 1.0}, {"j", 0.4}, {"s_closing", 1.0}}}) == plain);
  CHECK(stepped({"stiction", {{"s", 1.0}, {"j", 0.4}, {"s_closing", 1.8}}}) != plain);
  const auto complaint = [&](effects::EffectSpec spec) {
    effects::check_effect(spec, effects::Block::valve, context);
  };
  CHECK_THROWS_WITH(complaint({"stiction", {{"s", 1.0}, {"j", 0.4}, {"s_closing", 0.3}}}),
                    "s_closing must be at least j = 0.4 CO units (got 0.3), or j_closing be given "
                    "too");
  CHECK_THROWS_WITH(complaint({"stiction", {{"s", 1.0}, {"j", 0.4}, {"j_closing", 1.2}}}),
                    "j_closing must be at most s = 1 CO units (got 1.2)");
  CHECK_THROWS_WITH(
      complaint({"stiction", {{"s", 1.0}, {"j", 0.4}, {"j_closing", 0.3}}, {{"law", "he"}}}),
      "j_closing belongs to law choudhury");
}

}  // namespace stiction_closing_test
