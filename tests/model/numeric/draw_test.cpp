// SPDX-License-Identifier: Apache-2.0
#include "model/numeric/draw.hpp"

#include <catch2/catch.hpp>

namespace draw_test {

using loopwarden::numeric::chance;
using loopwarden::numeric::log_uniform;
using loopwarden::numeric::Random;

TEST_CASE("log_uniform: every factor is equally likely, within its limits", "[numeric]") {
  Random random(7);
  int below_geometric_mean = 0;
  for (int i = 0; i < 4000; ++i) {
    const double value = log_uniform(random, 0.1, 10.0);
    REQUIRE(value >= 0.1);
    REQUIRE(value <= 10.0);
    if (value < 1.0) ++below_geometric_mean;
  }
  CHECK(below_geometric_mean > 1900);
  CHECK(below_geometric_mean < 2100);
}

TEST_CASE("chance: is true as often as asked", "[numeric]") {
  Random random(8);
  int hits = 0;
  for (int i = 0; i < 4000; ++i) hits += chance(random, 0.25) ? 1 : 0;
  CHECK(hits > 900);
  CHECK(hits < 1100);
  CHECK_FALSE(chance(random, 0.0));
  CHECK(chance(random, 1.0));
}

}  // namespace draw_test
