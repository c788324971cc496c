// SPDX-License-Identifier: Apache-2.0
#include "model/control/move_sequence.hpp"

#include <catch2/catch.hpp>

namespace move_sequence_test {

using namespace loopwarden::control;

namespace {

constexpr double kPeriod_s = 0.1;

PlannedMovesSettings settings(bool read_back = true) {
  return {.gain = 1.5,
          .time_constant_s = 4.0,
          .dead_time_s = 2.0,
          .actuator_lag_s = 0.1,
          .s = 0.6,
          .j = 0.3,
          .read_back = read_back};
}

struct Bench {
  explicit Bench(bool read_back = true)
      : loop(settings(read_back), false, kPeriod_s),
        sequence(settings(read_back), false, kPeriod_s) {
    held.output = 5.15;
    for (int k = 0; k < 100; ++k) observe();
  }
  void observe() {
    alternates = -alternates;  // a read-back is renewed by its noise
    loop.observe({.set_point = 8.0,
                  .process_variable = 7.5,
                  .applied = held.output,
                  .commanded = held.output,
                  .valve_position = stem + alternates,
                  .valve_position_valid = read,
                  .limits = {.low = 0.0, .high = 10.0}},
                 true, false, held.output);
    held.pass(true, kPeriod_s);
  }
  // Steps until the stroke is over; 0: it is not.
  StrokeResult run(bool last, int most) {
    StrokeResult result = StrokeResult::under_way;
    for (periods = 0; periods < most && result == StrokeResult::under_way; ++periods) {
      observe();
      result = last ? sequence.step_last(loop, held) : sequence.step_first(loop, held);
    }
    return result;
  }
  void begin() {
    sequence.begin({.possible = true,
                    .direct = true,
                    .target = 6.0,
                    .first_target = 6.0,
                    .first_output = 6.15},
                   5.0, loop.limits(), held);
  }
  double stem = 5.0;
  double alternates = 0.001;
  bool read = true;
  int periods = 0;
  LoopEstimator loop;
  MoveSequence sequence;
  HeldOutput held;
};

}  // namespace

TEST_CASE("a stroke arrives when the stem has moved and stands", "[control][planned_moves]") {
  Bench bench;
  bench.begin();
  CHECK(bench.held.output == Approx(6.15));
  CHECK(bench.run(true, 2) == StrokeResult::under_way);
  bench.stem = 6.0;
  CHECK(bench.run(true, 30) == StrokeResult::arrived);
  CHECK_FALSE(bench.sequence.was_pushed());
}

TEST_CASE("a stem that does not move is pushed by at most the stick band",
          "[control][planned_moves]") {
  Bench bench;
  bench.begin();
  CHECK(bench.run(true, 200) == StrokeResult::stem_stuck);
  CHECK(bench.held.output > 6.15 + 0.5);
  CHECK(bench.held.output < 6.15 + 0.7);
  CHECK_FALSE(bench.sequence.fail());
  CHECK(bench.sequence.may_be_late());
  CHECK(bench.sequence.moved_late(5.2, 0.3));
  CHECK(bench.sequence.fail());
  bench.sequence.succeed();
  CHECK_FALSE(bench.sequence.fail());
}

TEST_CASE("while the read-back is lost a stroke stands still", "[control][planned_moves]") {
  Bench bench;
  bench.begin();
  bench.read = false;
  CHECK(bench.run(true, 200) == StrokeResult::under_way);
  CHECK(bench.held.output == Approx(6.15));
}

TEST_CASE("without a read-back a stroke ends by the actuator's time", "[control][planned_moves]") {
  Bench bench(false);
  bench.begin();
  CHECK(bench.run(true, 30) == StrokeResult::arrived);
  CHECK(bench.periods == 5);
}

TEST_CASE("a second stroke goes from where the stem is to the target", "[control][planned_moves]") {
  Bench bench;
  bench.sequence.begin({.possible = true, .target = 5.2, .first_target = 4.6, .first_output = 4.45},
                       5.0, bench.loop.limits(), bench.held);
  bench.run(false, 2);
  bench.stem = 4.6;
  REQUIRE(bench.run(false, 30) == StrokeResult::arrived);
  bench.sequence.begin_second(bench.loop, bench.held);
  CHECK(bench.held.output == Approx(5.35));
  CHECK(bench.sequence.from() == Approx(4.6).margin(0.01));
  CHECK(bench.sequence.to() == Approx(5.2));
}

}  // namespace move_sequence_test
