// SPDX-License-Identifier: Apache-2.0
#include "model/control/disturbance_estimator.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "model/numeric/random.hpp"

namespace disturbance_estimator_test {

using namespace loopwarden;
using namespace loopwarden::control;

namespace {

constexpr double kPeriod_s = 0.1;
const PlannedMovesSettings kSettings{
    .gain = 1.5, .time_constant_s = 4.0, .dead_time_s = 2.0, .load = 0.01, .s = 0.6, .j = 0.3};

}  // namespace

TEST_CASE("the disturbance is what PV has beyond the model", "[control][planned_moves]") {
  DisturbanceEstimator estimator(kSettings, kPeriod_s);
  numeric::Random random(5);
  NominalProcess plant(kSettings, kPeriod_s);
  plant.reset(4.0);
  double disturbance = 0.5;
  for (int k = 0; k < 4000; ++k) {
    const double stem = k < 2000 ? 4.0 : 4.4;
    if (k > 2500) disturbance = -0.2;
    plant.step(stem);
    estimator.step(plant.value() + disturbance + 0.01 * random.normal(), stem);
  }
  CHECK(estimator.disturbance() == Approx(-0.2).margin(0.02));
  CHECK(std::sqrt(estimator.noise_variance()) == Approx(0.01).margin(0.003));
  CHECK(estimator.variance() < 1e-3);
}

TEST_CASE("a PV that stays on one side of the model raises the variance",
          "[control][planned_moves]") {
  DisturbanceEstimator estimator(kSettings, kPeriod_s);
  for (int k = 0; k < 500; ++k) estimator.step(6.0, 4.0);
  const double before = estimator.variance();
  for (int k = 0; k < 20; ++k) estimator.step(8.0, 4.0);
  CHECK(estimator.variance() > 2.0 * before);
}

TEST_CASE("a move adds the uncertainty of the gain", "[control][planned_moves]") {
  DisturbanceEstimator estimator(kSettings, kPeriod_s);
  estimator.set_variance(0.0);
  estimator.add_gain_error(2.0);
  CHECK(estimator.variance() == Approx(0.04));
}

}  // namespace disturbance_estimator_test
