// SPDX-License-Identifier: Apache-2.0
#include "model/control/loop_estimator.hpp"

#include <catch2/catch.hpp>

namespace loop_estimator_test {

using namespace loopwarden::control;

namespace {

constexpr double kPeriod_s = 0.1;
const PlannedMovesSettings kSettings{
    .gain = 1.5, .time_constant_s = 1.0, .dead_time_s = 0.5, .s = 0.6, .j = 0.3};

// The real loop is at CO 5, stem 5, PV 7.5, SP 8.
CompensatorInputs inputs() {
  return {.set_point = 8.0,
          .process_variable = 7.5,
          .applied = 5.0,
          .commanded = 5.0,
          .valve_position = 5.0,
          .valve_position_valid = true,
          .limits = {.low = 0.0, .high = 10.0}};
}

}  // namespace

TEST_CASE("the expected offset is that of the stem at rest", "[control][planned_moves]") {
  LoopEstimator loop(kSettings, false, kPeriod_s);
  for (int k = 0; k < 200; ++k) loop.observe(inputs(), false, true, 0.0);
  CHECK(loop.expected_offset(loop.stem(false)) == Approx(0.5));
  CHECK(loop.error() == Approx(0.5));
  CHECK(loop.seen());
}

TEST_CASE("a shadow loop answers to its own CO, with the real disturbance",
          "[control][planned_moves]") {
  LoopEstimator loop(kSettings, true, kPeriod_s);
  for (int k = 0; k < 200; ++k) loop.observe(inputs(), false, true, 0.0);
  CHECK_FALSE(loop.seen());
  loop.take_over(5.0);
  for (int k = 0; k < 200; ++k) loop.observe(inputs(), true, false, 6.0);
  CHECK(loop.shadow_output() == 6.0);
  CHECK(loop.stem(true).position == Approx(5.85));
  CHECK(loop.stem(false).position == Approx(5.0));
  CHECK(loop.error() == Approx(0.5 - 1.5 * 0.85));
  loop.begin_acting();
  CHECK(loop.stem(true).position == Approx(5.0));
}

}  // namespace loop_estimator_test
