// SPDX-License-Identifier: Apache-2.0
#include "model/effects/stiction/stiction_he.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "model/effects/stiction/stiction_choudhury.hpp"

namespace stiction_he_test {

using namespace loopwarden;
using namespace loopwarden::effects;

TEST_CASE("the stem slips to the moving friction and sticks again", "[plant][stiction]") {
  StictionHe law({5.0, 2.0});  // fs 3.5, fd 1.5
  CHECK(law.reset(20.0) == 20.0);
  CHECK(law.step(23.5) == 20.0);
  CHECK(law.step(23.6) == Approx(22.1));
  CHECK(law.step(25.5) == Approx(22.1));  // stuck again: J more
  CHECK(law.step(25.7) == Approx(24.2));
  CHECK(law.step(20.8) == Approx(24.2));  // S after a reversal
  CHECK(law.step(20.6) == Approx(22.1));
}

TEST_CASE("on a ramp it has stick-slip where the Choudhury law moves on", "[plant][stiction]") {
  StictionHe he({5.0, 2.0});
  StictionChoudhury choudhury({5.0, 2.0});
  he.reset(0.0);
  choudhury.reset(0.0);
  int he_at_rest = 0;
  int choudhury_at_rest = 0;
  double he_last = 0.0;
  double choudhury_last = 0.0;
  for (int k = 1; k <= 1000; ++k) {
    const double u = 0.1 * k;
    const double x = he.step(u);
    const double y = choudhury.step(u);
    if (u > 4.0) {
      he_at_rest += x == he_last ? 1 : 0;
      choudhury_at_rest += y == choudhury_last ? 1 : 0;
      // The two are never farther apart than a jump.
      REQUIRE(std::abs(x - y) <= 2.0 + 1e-9);
    }
    he_last = x;
    choudhury_last = y;
  }
  CHECK(choudhury_at_rest == 0);
  CHECK(he_at_rest > 900);  // it moves once in J = 20 samples
}

TEST_CASE("if every command is a large step, the two laws agree", "[plant][stiction]") {
  StictionHe he({5.0, 2.0});
  StictionChoudhury choudhury({5.0, 2.0});
  he.reset(0.0);
  choudhury.reset(0.0);
  for (const double u : {10.0, 20.0, 20.0, 8.0, -3.0, -3.0, 6.0}) {
    CHECK(he.step(u) == Approx(choudhury.step(u)));
  }
}

TEST_CASE("the He law: severity and bad input", "[plant][stiction]") {
  StictionHe law({5.0, 2.0});
  law.reset(0.0);
  law.set_severity(0.5);
  CHECK(law.step(1.74) == 0.0);
  CHECK(law.step(1.76) == Approx(1.01));
  CHECK(law.step(std::numeric_limits<double>::infinity()) == Approx(1.01));
  CHECK(law.step(std::numeric_limits<double>::quiet_NaN()) == Approx(1.01));
  law.set_severity(0.0);
  CHECK(law.step(-7.5) == -7.5);
}

}  // namespace stiction_he_test
