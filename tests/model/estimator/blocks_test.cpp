// SPDX-License-Identifier: Apache-2.0
#include "model/estimator/blocks.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "model/numeric/random.hpp"

namespace blocks_test {

using namespace loopwarden::estimator;

TEST_CASE("a block is the mean of the samples that count", "[estimator][blocks]") {
  const Observed observed{
      0.5, {0, 0, 0, 0, 0, 0}, {1, 3, 5, 100, 9, 9}, {true, true, true, false, false, false}};
  const Blocks blocks(observed, 6, 2, 0.2);
  REQUIRE(blocks.count() == 3);
  CHECK(blocks.pv() == std::vector<double>{2.0, 5.0, 0.0});
  CHECK(blocks.variance()[0] == Approx(0.02));
  CHECK(blocks.variance()[1] == Approx(0.04));
  CHECK(blocks.variance()[2] == 0.0);
  CHECK(blocks.time_s(1) == Approx(1.25));

  std::vector<double> means(3);
  blocks.average(std::vector<double>{2, 4, 6, 50, 1, 1}, means);
  CHECK(means == std::vector<double>{3.0, 6.0, 0.0});
}

TEST_CASE("the noise of a record does not contain its slow moves", "[estimator][blocks]") {
  loopwarden::numeric::Random random(5);
  Observed observed{0.1, std::vector<double>(4000, 0.0), {}, std::vector<bool>(4000, true)};
  for (int k = 0; k < 4000; ++k) {
    observed.pv.push_back(3.0 * std::sin(0.01 * k) + 0.05 * random.normal());
  }
  CHECK(noise_of(observed, 4000, 0.0, 10.0) == Approx(0.05).epsilon(0.06));
  CHECK(noise_of(observed, 4000, 1.0, 10.0) == Approx(1.0 / std::sqrt(12.0)));
}

TEST_CASE("blocks are short against the time constant, and many", "[estimator][blocks]") {
  CHECK(block_length(4.0, 0.1, 4000) == 4);
  CHECK(block_length(0.5, 0.1, 900) == 1);
  CHECK(block_length(400.0, 0.1, 3000) == 5);
}

TEST_CASE("a short excursion of PV is a spike, a longer one is a disturbance",
          "[estimator][blocks]") {
  Observed observed{0.1, std::vector<double>(200, 5.0), std::vector<double>(200, 5.0), {}};
  observed.used.assign(200, true);
  for (std::size_t k = 40; k < 43; ++k) observed.pv[k] = 7.0;
  observed.pv[43] = 6.5;  // comes back in two steps
  for (std::size_t k = 100; k < 150; ++k) observed.pv[k] = 7.0;
  const Observed out = without_spikes(observed, 0.5, 12);
  for (std::size_t k = 0; k < 200; ++k) {
    INFO(k);
    CHECK(out.used[k] == (k < 40 || k > 43));
  }
  CHECK(out.pv == observed.pv);
}

}  // namespace blocks_test
