// SPDX-License-Identifier: Apache-2.0
#include "model/numeric/statistics.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include "model/numeric/random.hpp"
#include "model/numeric/root_sum_square.hpp"
#include "tests/support/rt_guard.hpp"

namespace statistics_test {

using namespace loopwarden;
using namespace loopwarden::numeric;

TEST_CASE("moments, calculated on paper", "[numeric]") {
  const std::vector<double> x{2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0};
  CHECK(mean(x) == 5.0);
  CHECK(variance(x) == 4.0);
  CHECK(deviation(x) == 2.0);
  CHECK(rms(x) == Approx(std::sqrt(29.0)).epsilon(1e-15));
  CHECK(skewness(x) == Approx(5.25 / 8.0).epsilon(1e-15));
  CHECK(kurtosis(x) == Approx(2.78125).epsilon(1e-15));
}

TEST_CASE("kurtosis of known shapes", "[numeric]") {
  std::vector<double> sine, square, ramp;
  for (int k = 0; k < 10'000; ++k) {
    const double phase = (k + 0.5) / 10'000.0;
    sine.push_back(std::sin(2.0 * std::numbers::pi * phase));
    square.push_back(phase < 0.5 ? 3.0 : -1.0);
    ramp.push_back(phase);
  }
  CHECK(kurtosis(sine) == Approx(1.5));
  CHECK(kurtosis(square) == Approx(1.0));
  CHECK(kurtosis(ramp) == Approx(1.8));
  CHECK(skewness(sine) == Approx(0.0).margin(1e-12));
}

TEST_CASE("a quantile is one of the values, at the nearest place", "[numeric]") {
  const std::vector<double> x{9.0, 1.0, 8.0, 2.0, 7.0, 3.0, 6.0, 4.0, 5.0};
  CHECK(quantile(x, 0.0) == 1.0);
  CHECK(quantile(x, 0.25) == 3.0);
  CHECK(quantile(x, 0.3) == 3.0);   // place 2.4
  CHECK(quantile(x, 0.32) == 4.0);  // place 2.56
  CHECK(quantile(x, 1.0) == 9.0);
  CHECK(median(x) == 5.0);
  CHECK(median({4.0, 1.0, 3.0, 2.0}) == 3.0);
  CHECK(median({7.0}) == 7.0);
}

TEST_CASE("a median doesn't follow a few wild values", "[numeric]") {
  const std::vector<double> x{1.0, 1.0, 2.0, 2.0, 4.0, 6.0, 1e9};
  CHECK(median(x) == 2.0);
  Random random(4);
  std::vector<double> normal(20'001);
  for (double& v : normal) v = 3.0 + 0.5 * random.normal();
  for (std::size_t k = 0; k < 100; ++k) normal[k] = 1e6;
  std::vector<double> off;
  const double middle = median(normal);
  for (const double v : normal) off.push_back(std::abs(v - middle));
  CHECK(kNormalOverMad * median(off) == Approx(0.5).epsilon(0.02));
  CHECK(deviation(normal) > 1e4);
  // Normal quantiles, from tables.
  CHECK(quantile(normal, 0.1) == Approx(3.0 - 0.5 * 1.2816).epsilon(0.01));
}

TEST_CASE("ranges and distances ignore missing values", "[numeric]") {
  const double nan = std::nan("");
  const Range range = range_of(std::vector<double>{nan, 3.0, -1.0, nan, 2.0});
  CHECK(range.low == -1.0);
  CHECK(range.high == 3.0);
  CHECK(range_of(std::vector<double>{nan}).high == 0.0);
  const std::vector<double> x{1.0, 2.0, 3.0};
  CHECK(rms_apart(x, std::vector<double>{4.0, nan, -1.0}) == Approx(std::sqrt(12.5)));
  CHECK(rms_apart(x, std::vector<double>{nan, nan, nan}) == 0.0);
}

TEST_CASE("correlation of lines and of unrelated values", "[numeric]") {
  const std::vector<double> x{1.0, 2.0, 3.0, 4.0};
  CHECK(correlation(x, std::vector<double>{5.0, 7.0, 9.0, 11.0}) == Approx(1.0));
  CHECK(correlation(x, std::vector<double>{4.0, 3.0, 2.0, 1.0}) == Approx(-1.0));
  CHECK(correlation(x, std::vector<double>{1.0, -1.0, -1.0, 1.0}) == Approx(0.0).margin(1e-15));
}

TEST_CASE("empty input, and values without spread", "[numeric]") {
  const std::vector<double> none;
  const std::vector<double> same(5, 2.5);
  for (const double value :
       {mean(none), variance(none), rms(none), kurtosis(none), median(none), quantile(none, 0.9)}) {
    CHECK(value == 0.0);
  }
  for (const double value : {variance(same), kurtosis(same), skewness(same),
                             correlation(same, std::vector<double>{1.0, 2.0, 3.0, 4.0, 5.0})}) {
    CHECK(value == 0.0);
  }
}

TEST_CASE("a quantile in place doesn't allocate", "[numeric]") {
  std::vector<double> x{5.0, 3.0, 1.0};
  tests::RealTimeSection::reset();
  double middle = 0.0;
  {
    const tests::RealTimeSection section;
    middle = quantile_in_place(x, 0.5);
  }
  CHECK(middle == 3.0);
  CHECK(tests::RealTimeSection::offences() == 0);
}

TEST_CASE("root of a sum of squares", "[numeric]") {
  CHECK(root_sum_square(3.0, -4.0) == 5.0);
  CHECK(root_sum_square(0.0, -2.0) == 2.0);
}

}  // namespace statistics_test
