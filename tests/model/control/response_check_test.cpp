// SPDX-License-Identifier: Apache-2.0
#include "model/control/response_check.hpp"

#include <catch2/catch.hpp>

namespace response_check_test {

using namespace loopwarden::control;

namespace {

constexpr double kPeriod_s = 0.1;

struct Bench {
  explicit Bench(bool read_back = true)
      : settings{.gain = 1.5,
                 .time_constant_s = 1.0,
                 .dead_time_s = 0.5,
                 .s = 0.6,
                 .j = 0.3,
                 .read_back = read_back},
        check(settings),
        disturbance(settings, kPeriod_s) {
    steps();
  }
  void steps() {
    for (int k = 0; k < 300; ++k) disturbance.step(pv, stem);
  }
  // The stem moves by `by`; `answers`: PV follows.
  Response move(double by, bool answers) {
    check.begin(stem, disturbance);
    stem += by;
    if (answers) pv += 1.5 * by;
    steps();
    check.await(true);
    CHECK(check.due());
    const Response response = check.judge(stem, disturbance, 10.0);
    CHECK_FALSE(check.due());
    return response;
  }
  PlannedMovesSettings settings;
  ResponseCheck check;
  DisturbanceEstimator disturbance;
  double stem = 5.0;
  double pv = 7.5;
};

}  // namespace

TEST_CASE("a PV that follows a move answers it", "[control][planned_moves]") {
  Bench bench;
  for (int k = 0; k < 4; ++k) CHECK(bench.move(0.5, true) == Response::answered);
  CHECK(bench.move(1e-5, false) == Response::too_small);
}

TEST_CASE("a PV that stands still in two moves contradicts the read-back",
          "[control][planned_moves]") {
  Bench bench;
  CHECK(bench.move(0.5, false) == Response::missing);
  CHECK(bench.move(-0.5, true) == Response::answered);
  CHECK(bench.move(0.5, false) == Response::missing);
  CHECK(bench.move(0.5, false) == Response::contradicts);
}

TEST_CASE("without a read-back six moves without an answer contradict",
          "[control][planned_moves]") {
  Bench bench(false);
  for (int k = 0; k < 5; ++k) CHECK(bench.move(0.5, false) == Response::missing);
  CHECK(bench.move(0.5, false) == Response::contradicts);
}

TEST_CASE("a stem that moved without a plan contradicts a PV that stands still",
          "[control][planned_moves]") {
  Bench bench;
  bench.check.slipped();
  CHECK(bench.check.has_slipped());
  CHECK(bench.move(0.5, false) == Response::contradicts);
}

}  // namespace response_check_test
