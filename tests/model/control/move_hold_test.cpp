// SPDX-License-Identifier: Apache-2.0
#include "model/control/move_hold.hpp"

#include <catch2/catch.hpp>
#include <limits>

namespace move_hold_test {

using namespace loopwarden::control;

namespace {

constexpr std::uint64_t kLease = 5;

// A hold whose controller wants 40 and whose CO is at 30 CO units.
struct Bench {
  Bench() { hold.restart(); }

  // Answers the newest sample.
  MovesRequest answer(HoldAction action, double held_at = 0.0) const {
    const MovesSample& sample = hold.sample();
    return {.run = sample.run,
            .shadow = sample.shadow,
            .number = sample.number,
            .valid_until = sample.number + kLease,
            .action = action,
            .output = held_at,
            .pv_low = 4.0,
            .pv_high = 6.0};
  }
  Correction step(const MovesRequest& request) {
    return hold.step(
        {.set_point = set_point, .output = output, .process_variable = pv, .applied = 30.0},
        request, settings);
  }
  void begin() {
    step({});
    step(answer(HoldAction::hold_here));
    REQUIRE(hold.sample().holding);
  }

  CompensatorSettings settings{.kind = CompensatorKind::planned_moves};
  MoveHold hold;
  double set_point = 5.0;
  double output = 40.0;
  double pv = 5.0;
};

}  // namespace

TEST_CASE("a hold begins at the present CO and then follows its requests",
          "[control][planned_moves]") {
  Bench bench;
  bench.step({});
  CHECK(bench.step(bench.answer(HoldAction::hold_at, 35.0)).added == 0.0);  // not begun
  CHECK_FALSE(bench.hold.sample().holding);
  const Correction begun = bench.step(bench.answer(HoldAction::hold_here));
  CHECK(begun.added == -10.0);
  CHECK(begun.hold_integral);
  CHECK(bench.step(bench.answer(HoldAction::hold_at, 35.0)).added == -5.0);
  CHECK(bench.step(bench.answer(HoldAction::hold_here)).added == -5.0);
  CHECK(bench.step(bench.answer(HoldAction::hold_at, 135.0)).added == 60.0);  // the output's limit
  const Correction ended = bench.step(bench.answer(HoldAction::release));
  CHECK(ended.release);
  CHECK(ended.added == 0.0);
}

TEST_CASE("a request that is too old begins no hold and ends the one that it began",
          "[control][planned_moves]") {
  Bench bench;
  bench.step({});
  const MovesRequest request = bench.answer(HoldAction::hold_here);
  SECTION("not begun") {
    for (std::uint64_t k = 0; k < kLease; ++k) bench.step({});
    CHECK_FALSE(bench.step(request).hold_integral);
  }
  SECTION("begun") {
    for (std::uint64_t k = 0; k < kLease; ++k) CHECK(bench.step(request).hold_integral);
    CHECK(bench.step(request).release);
    // It does not begin again without a hold_here.
    CHECK_FALSE(bench.step(bench.answer(HoldAction::hold_at, 35.0)).hold_integral);
  }
}

TEST_CASE("a request from before a restart of the law or from shadow is not carried out",
          "[control][planned_moves]") {
  Bench bench;
  SECTION("restart") {
    bench.begin();
    const MovesRequest request = bench.answer(HoldAction::hold_here);
    bench.hold.restart();
    CHECK_FALSE(bench.step(request).hold_integral);
  }
  SECTION("from shadow to acting") {
    bench.settings.shadow = true;
    bench.begin();
    const MovesRequest request = bench.answer(HoldAction::hold_at, 35.0);
    CHECK(bench.step(request).added == -5.0);
    bench.settings.shadow = false;
    CHECK_FALSE(bench.step(request).hold_integral);
    CHECK_FALSE(bench.step(bench.answer(HoldAction::hold_at, 35.0)).hold_integral);
  }
}

TEST_CASE("a hold that ends at a new set point gives CO the law's step for it",
          "[control][planned_moves]") {
  Bench bench;
  bench.begin();
  const MovesRequest made_before = bench.answer(HoldAction::hold_here);
  bench.set_point = 5.5;
  bench.output = 42.0;
  CHECK(bench.step(made_before).added == -12.0);
  SECTION("released") { CHECK(bench.step(bench.answer(HoldAction::release)).added == 2.0); }
  SECTION("too old") {
    for (std::uint64_t k = 1; k < kLease; ++k) bench.step(made_before);
    CHECK(bench.step(made_before).added == 2.0);
  }
  SECTION("held on") {
    bench.step(bench.answer(HoldAction::hold_here));
    CHECK(bench.step(bench.answer(HoldAction::release)).added == 0.0);
  }
}

TEST_CASE("the reason of a shadow is not that of the acting planned moves",
          "[control][planned_moves]") {
  Bench bench;
  bench.settings.shadow = true;
  bench.step({});
  MovesRequest request = bench.answer(HoldAction::release);
  request.disengaged = DisengageReason::no_gain;
  bench.step(request);
  REQUIRE(bench.hold.disengaged() == DisengageReason::no_gain);
  bench.settings.shadow = false;
  bench.step(request);
  CHECK(bench.hold.disengaged() == DisengageReason::none);
}

TEST_CASE("a request without a number for its output or its band ends a hold",
          "[control][planned_moves]") {
  Bench bench;
  bench.begin();
  MovesRequest request = bench.answer(HoldAction::hold_at, 35.0);
  double* const number = GENERATE_REF(&request.output, &request.pv_low, &request.pv_high);
  *number = std::numeric_limits<double>::quiet_NaN();
  const Correction ended = bench.step(request);
  CHECK(ended.release);
  CHECK(ended.added == 0.0);
}

TEST_CASE("a hold ends when PV leaves the band of its request", "[control][planned_moves]") {
  Bench bench;
  bench.begin();
  bench.pv = GENERATE(3.9, 6.1);
  CHECK(bench.step(bench.answer(HoldAction::hold_here)).release);
}

}  // namespace move_hold_test
