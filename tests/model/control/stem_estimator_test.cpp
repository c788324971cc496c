// SPDX-License-Identifier: Apache-2.0
#include "model/control/stem_estimator.hpp"

#include <catch2/catch.hpp>

#include "model/numeric/random.hpp"

namespace stem_estimator_test {

using namespace loopwarden;
using namespace loopwarden::control;

namespace {

constexpr double kPeriod_s = 0.1;

PlannedMovesSettings settings(bool read_back) {
  return {.s = 0.6, .j = 0.3, .read_back = read_back};
}

struct Bench {
  explicit Bench(bool read_back)
      : friction(settings(read_back)), estimator(settings(read_back), kPeriod_s) {}
  void steps(int count, double output, double read, bool valid = true, bool learns = true) {
    for (int k = 0; k < count; ++k) {
      const double noise = 0.001 * random.normal();
      estimator.step(
          {.applied = output, .valve_position = read + noise, .valve_position_valid = valid},
          learns, friction);
    }
  }
  numeric::Random random{3};
  ValveFriction friction;
  StemEstimator estimator;
};

}  // namespace

TEST_CASE("the stem's position is the mean of the read-back while it stands",
          "[control][planned_moves]") {
  Bench bench(true);
  bench.steps(300, 5.0, 4.9);
  CHECK(bench.estimator.stem().position == Approx(4.9).margin(3e-4));
  CHECK(bench.estimator.stem().travel == 0.0);
  CHECK(bench.estimator.zone() < 0.02);
}

TEST_CASE("a slip that is read back is a move of the stem, and shows the friction",
          "[control][planned_moves]") {
  const bool learns = GENERATE(true, false);
  Bench bench(true);
  bench.steps(100, 5.0, 4.9);
  bench.steps(1, 5.5, 4.9, true, learns);
  bench.steps(3, 5.5, 5.3, true, learns);
  CHECK(bench.estimator.stem().position == Approx(5.3).margin(0.003));
  CHECK(bench.estimator.stem().previous == Approx(4.9).margin(0.003));
  CHECK(bench.estimator.stem().travel == Approx(0.4).margin(0.005));
  CHECK(bench.estimator.stem().standing_s <= 0.3);
  CHECK(bench.friction.breakaway(1.0) == Approx(learns ? 0.525 : 0.45).margin(0.01));
}

TEST_CASE("a lost read-back leaves the stem where it was", "[control][planned_moves]") {
  Bench bench(true);
  bench.steps(100, 5.0, 4.9);
  bench.steps(7, 9.0, 0.0, false);
  CHECK(bench.estimator.lost_samples() == 7);
  CHECK(bench.estimator.stem().position == Approx(4.9).margin(0.003));
  bench.steps(1, 5.0, 4.9);
  CHECK(bench.estimator.lost_samples() == 0);
}

TEST_CASE("without a read-back the stem follows CO by the law of stiction",
          "[control][planned_moves]") {
  Bench bench(false);
  bench.steps(1, 5.0, 0.0);
  CHECK(bench.estimator.stem().position == Approx(5.0));
  bench.steps(1, 5.4, 0.0);  // the breakaway is 0.45
  CHECK(bench.estimator.stem().position == Approx(5.0));
  bench.steps(1, 5.5, 0.0);
  CHECK(bench.estimator.stem().position == Approx(5.35));
  bench.steps(1, 5.3, 0.0);
  CHECK(bench.estimator.stem().position == Approx(5.35));
  CHECK(bench.estimator.stem().travel == Approx(0.35));
}

TEST_CASE("a read-back that a gateway holds counts once per value", "[control][planned_moves]") {
  ReadBackClock clock(10);
  int counted = 0;
  for (int k = 0; k < 300; ++k) counted += clock.step(k % 30 == 0) ? 1 : 0;
  CHECK(clock.renewal() == 10);
  CHECK(counted >= 20);
  counted = 0;
  for (int k = 0; k < 300; ++k) counted += clock.step(k % 5 == 0) ? 1 : 0;
  CHECK(clock.renewal() == 5);
  CHECK(counted == 60);
}

}  // namespace stem_estimator_test
