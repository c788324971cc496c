// SPDX-License-Identifier: Apache-2.0
#include "lab/plant1/shared_fit.hpp"

#include <catch2/catch.hpp>
#include <cmath>

namespace shared_fit_test {

using namespace loopwarden::lab;

namespace {

// Record r is a straight line with the shared slope and a separate offset.
SharedFitProblem lines() {
  SharedFitProblem problem;
  problem.shared = {{"slope", -10.0, 10.0}};
  problem.own = {{{"offset", -5.0, 5.0}}, {{"offset", -5.0, 5.0}}, {}};
  problem.cost = [](std::size_t r, std::span<const double> shared, std::span<const double> own) {
    const double offset = r == 0 ? 1.5 : r == 1 ? -3.0 : 0.0;
    double sum = 0.0;
    for (int k = 0; k < 10; ++k) {
      const double error = (shared[0] - 2.5) * k + (own.empty() ? 0.0 : own[0]) - offset;
      sum += error * error;
    }
    return sum;
  };
  return problem;
}

}  // namespace

TEST_CASE("shared and own parameters are found together", "[shared_fit]") {
  const SharedFit fit = fit_shared(lines(), {.population = 20, .generations = 200, .seed = 3});
  CHECK(fit.shared[0] == Approx(2.5).margin(1e-4));
  CHECK(fit.own[0][0] == Approx(1.5).margin(1e-3));
  CHECK(fit.own[1][0] == Approx(-3.0).margin(1e-3));
  CHECK(fit.own[2].empty());
  REQUIRE(fit.cost.size() == 3);
  CHECK(fit.total == Approx(fit.cost[0] + fit.cost[1] + fit.cost[2]));
}

TEST_CASE("the fit does not depend on the number of threads, only on the seed", "[shared_fit]") {
  const auto run = [](unsigned threads, std::uint64_t seed) {
    return fit_shared(
        lines(),
        {.population = 12, .generations = 15, .islands = 3, .seed = seed, .threads = threads});
  };
  const SharedFit one = run(1, 7);
  const SharedFit four = run(4, 7);
  CHECK(one.shared == four.shared);
  CHECK(one.own == four.own);
  CHECK(one.total == four.total);
  CHECK(run(1, 8).shared != one.shared);
}

TEST_CASE("parameters keep to their bounds", "[shared_fit]") {
  SharedFitProblem problem = lines();
  problem.shared[0].high = 2.0;
  const SharedFit fit = fit_shared(problem, {.population = 20, .generations = 100, .seed = 3});
  CHECK(fit.shared[0] <= 2.0);
  CHECK(fit.shared[0] == Approx(2.0).margin(1e-2));
}

TEST_CASE("a start is never replaced by a worse one", "[shared_fit]") {
  const SharedFit good = fit_shared(lines(), {.population = 20, .generations = 200, .seed = 3});
  const SharedFit again =
      fit_shared(lines(), {.population = 8, .generations = 1, .seed = 9}, &good);
  CHECK(again.total <= good.total);
}

TEST_CASE("more islands never end worse, and progress counts them all", "[shared_fit]") {
  const auto run = [](std::size_t islands, std::size_t& last) {
    return fit_shared(lines(), {.population = 8,
                                .generations = 10,
                                .islands = islands,
                                .seed = 5,
                                .threads = 2,
                                .progress = [&](std::size_t done) { last = done; }});
  };
  std::size_t one_done = 0;
  std::size_t five_done = 0;
  const SharedFit one = run(1, one_done);
  const SharedFit five = run(5, five_done);
  CHECK(five.total <= one.total);
  CHECK(one_done == 10);
  CHECK(five_done == 50);
}

}  // namespace shared_fit_test
