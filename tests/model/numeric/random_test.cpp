// SPDX-License-Identifier: Apache-2.0
#include "model/numeric/random.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <cstdint>

namespace random_test {

using loopwarden::numeric::Random;

TEST_CASE("the first numbers are those of xoshiro256++ after splitmix64", "[numeric][random]") {
  // Values of an independent implementation.
  Random one(1);
  CHECK(one.bits() == 0xcfc5d07f6f03c29bULL);
  CHECK(one.bits() == 0xbf424132963fe08dULL);
  CHECK(one.bits() == 0x19a37d5757aaf520ULL);
  CHECK(one.bits() == 0xbf08119f05cd56d6ULL);
  Random other(42);
  CHECK(other.bits() == 0xd0764d4f4476689fULL);
}

TEST_CASE("uniform numbers, by value", "[numeric][random]") {
  Random random(1);
  CHECK(random.uniform() == 0.8116121588818849);
  CHECK(random.uniform() == 0.7471047161582188);
  CHECK(random.uniform(-2.0, 4.0) == Approx(-2.0 + 6.0 * 0.10015090353378386).epsilon(1e-15));
}

TEST_CASE("normal numbers are the quantiles of the uniform ones", "[numeric][random]") {
  Random one(1);
  for (const double z : {0.8838527949761762, 0.6654064389170713, -1.2806921814836767}) {
    CHECK(one.normal() == Approx(z).epsilon(2e-9));
  }
  Random other(42);
  for (const double z : {0.8938732534857364, -0.4709981162414728, 2.1417741113345365}) {
    CHECK(other.normal() == Approx(z).epsilon(2e-9));
  }
}

TEST_CASE("uniform numbers fill the interval evenly", "[numeric][random]") {
  Random random(3);
  constexpr int kDraws = 200'000;
  double sum = 0.0;
  double squares = 0.0;
  for (int k = 0; k < kDraws; ++k) {
    const double u = random.uniform();
    REQUIRE((u > 0.0 && u < 1.0));
    sum += u;
    squares += u * u;
  }
  CHECK(sum / kDraws == Approx(0.5).margin(0.003));
  CHECK(squares / kDraws == Approx(1.0 / 3.0).margin(0.003));
}

TEST_CASE("normal numbers have the moments of the normal distribution", "[numeric][random]") {
  const std::uint64_t seed = GENERATE(1U, 77U, 123456789U);
  Random random(seed);
  constexpr int kDraws = 400'000;
  double moment[5] = {};
  double lagged = 0.0;
  double last = 0.0;
  int beyond_three = 0;
  for (int k = 0; k < kDraws; ++k) {
    const double z = random.normal();
    double power = 1.0;
    for (double& m : moment) {
      m += power / kDraws;
      power *= z;
    }
    lagged += z * last / kDraws;
    last = z;
    if (std::abs(z) > 3.0) ++beyond_three;
  }
  CHECK(moment[1] == Approx(0.0).margin(0.008));
  CHECK(moment[2] == Approx(1.0).margin(0.012));
  CHECK(moment[3] == Approx(0.0).margin(0.03));
  CHECK(moment[4] == Approx(3.0).margin(0.1));
  CHECK(lagged == Approx(0.0).margin(0.008));
  CHECK(beyond_three == Approx(0.0026998 * kDraws).epsilon(0.15));
}

TEST_CASE("the short generator's first numbers, and that they fill the interval",
          "[numeric][random]") {
  // Values of an independent implementation.
  loopwarden::numeric::ShortRandom random;
  for (const double u : {5311558.0, 14691925.0, 8108431.0}) CHECK(random.uniform() * 0x1p24 == u);
  double sum = 0.0;
  double squares = 0.0;
  for (int k = 0; k < 100'000; ++k) {
    const double u = random.uniform(-1.0, 1.0);
    REQUIRE((u >= -1.0 && u < 1.0));
    sum += u;
    squares += u * u;
  }
  CHECK(sum / 100'000 == Approx(0.0).margin(0.01));
  CHECK(squares / 100'000 == Approx(1.0 / 3.0).margin(0.005));
}

}  // namespace random_test
