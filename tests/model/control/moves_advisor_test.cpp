// SPDX-License-Identifier: Apache-2.0
#include "model/control/moves_advisor.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "model/control/loop_controller.hpp"
#include "model/plant/plant.hpp"

namespace moves_advisor_test {

using namespace loopwarden;
using namespace loopwarden::control;

namespace {

constexpr double kPeriod_s = 0.1;
constexpr int kLease = 50;

plant::LoopModel sticking_loop(double load = 0.0) {
  plant::LoopModel m;
  m.sample_time_s = kPeriod_s;
  m.controller.pid = {.gains = {.kp = 0.25, .ki = 0.06}, .output_high = 10.0};
  m.controller.output.high = 10.0;
  m.controller.set_point.high = 15.0;
  m.process = {.gain = 1.5, .time_constant_s = 4.0, .dead_time_s = 2.0};
  m.transmitter = {.high = 15.0, .noise = 0.01};
  m.valve_effects = {{.name = "stiction", .parameters = {{"s", 0.6}, {"j", 0.3}}}};
  if (load > 0.0) {
    m.disturbances = {
        {.name = "random_load", .parameters = {{"intensity", load}, {"time_constant", 300.0}}}};
  }
  m.controller.compensator = {.kind = CompensatorKind::planned_moves,
                              .planned = {.gain = 1.5,
                                          .time_constant_s = 4.0,
                                          .dead_time_s = 2.0,
                                          .load = load,
                                          .s = 0.6,
                                          .j = 0.3}};
  return m;
}

// A loop whose advisor takes its samples every `turn` periods, as on another thread.
struct Bench {
  explicit Bench(const plant::LoopModel& m, int turn = 1)
      : turn_periods(turn), plant(m, 3), controller(m.controller, kPeriod_s, 7.0, 0.0) {
    co = plant.output_for(7.0);
    plant.reset(co);
    controller.assume_output(co);
    controller.request_mode(Mode::automatic);
    controller.request_set_point(8.0);
  }

  void step() {
    controller_step();
    plant.step(co);
    squares += std::pow(controller.set_point_target() - plant.true_process_variable(), 2);
    if (advisor_runs && ++waited >= turn_periods) take_turn();
  }
  void controller_step() {
    co = controller
             .step({.process_variable = plant.process_variable(),
                    .read_back = plant.stem(),
                    .read_back_valid = true,
                    .moves = request})
             .output;
    if (const MovesSample* sample = controller.moves_sample()) samples.push_back(*sample);
  }
  void take_turn() {
    waited = 0;
    for (const MovesSample& sample : samples) advisor.step(sample);
    samples.clear();
    request = advisor.request();
  }
  void steps(int count) {
    for (int k = 0; k < count; ++k) step();
  }
  bool holds() const {
    const MovesSample* sample = controller.moves_sample();
    return sample != nullptr && sample->holding;
  }
  MovePhase phase() const { return advisor.state().value_or(MovesState{}).phase; }
  void until(MovePhase wanted) {
    for (int k = 0; k < 60000 && phase() != wanted; ++k) step();
    REQUIRE(phase() == wanted);
    REQUIRE(holds());
  }

  int turn_periods;
  plant::Plant plant;
  LoopController controller;
  MovesAdvisor advisor{kPeriod_s, kLease};
  MovesRequest request;
  std::vector<MovesSample> samples;
  bool advisor_runs = true;
  int waited = 0;
  double co = 0.0;
  double squares = 0.0;  // of SP - PV
};

}  // namespace

TEST_CASE("planned moves stop the cycle with an advisor that takes several samples at once",
          "[control][planned_moves]") {
  const int turn = GENERATE(1, 5, 20);
  CAPTURE(turn);
  const auto rms_of = [&](bool moves) {
    Bench bench(sticking_loop(), turn);
    bench.advisor_runs = moves;
    bench.steps(20000);
    bench.squares = 0.0;
    bench.steps(20000);
    if (moves) CHECK(bench.advisor.state()->reason == DisengageReason::none);
    return std::sqrt(bench.squares);
  };
  CHECK(rms_of(true) < 0.4 * rms_of(false));
}

TEST_CASE("if the advisor stops, the hold ends in time and PI takes over without a bump",
          "[control][planned_moves]") {
  Bench bench(sticking_loop(0.01));
  bench.until(
      GENERATE(MovePhase::probing, MovePhase::resting, MovePhase::backing_off, MovePhase::moving));
  bench.advisor_runs = false;
  int held = 0;
  while (bench.holds() && held <= kLease + 1) {
    bench.step();
    ++held;
  }
  CHECK(held == kLease + 1);
  double before = bench.co;
  double largest = 0.0;
  for (int k = 0; k < 20; ++k) {
    bench.step();
    largest = std::max(largest, std::abs(bench.co - before));
    before = bench.co;
  }
  CHECK(largest < 0.05);  // the law's response to noise
  CHECK(bench.co != bench.request.output);
  // Requests from before the stop are not carried out when the advisor runs again.
  bench.advisor_runs = true;
  bench.step();
  CHECK_FALSE(bench.holds());
  CHECK(bench.advisor.state()->reason == DisengageReason::interrupted);
}

TEST_CASE("a late advisor pushes no farther at once than a prompt one",
          "[control][planned_moves]") {
  plant::LoopModel m = sticking_loop(0.01);
  m.valve_effects.front().parameters["s"] = 1.5;  // planned moves are told 0.6
  Bench bench(m, GENERATE(1, 20));
  double largest = 0.0;
  for (int k = 0; k < 40000; ++k) {
    const MovePhase phase = bench.phase();
    const double before = bench.request.output;
    bench.step();
    const bool pushes = phase == MovePhase::backing_off || phase == MovePhase::moving;
    if (pushes && bench.phase() == phase) {
      largest = std::max(largest, std::abs(bench.request.output - before));
    }
  }
  CHECK(largest > 0.0);
  CHECK(largest < 0.05);  // the estimate of s per 3 s
}

TEST_CASE("a probe that the stem follows is taken back before the hold ends",
          "[control][planned_moves]") {
  plant::LoopModel m = sticking_loop();
  m.valve_effects.clear();
  m.disturbances = {
      {.name = "oscillating_disturbance", .parameters = {{"amplitude", 0.3}, {"period", 60.0}}}};
  Bench bench(m, GENERATE(1, 20));
  bench.until(MovePhase::probing);
  const double held = bench.request.output;
  double last = held;
  while (bench.holds()) {
    last = bench.controller.moves_sample()->held;
    bench.step();
  }
  CHECK(bench.advisor.state()->reason == DisengageReason::valve_follows);
  CHECK(last == Approx(held));
}

TEST_CASE("an operator's output during a move wins, and the move does not go on after it",
          "[control][planned_moves]") {
  Bench bench(sticking_loop(0.01));
  bench.until(MovePhase::moving);
  const MovesRequest made_before = bench.request;
  bench.controller.request_mode(Mode::manual);
  bench.controller.request_output(2.0);
  bench.step();
  CHECK(bench.co == 2.0);
  bench.controller.request_mode(Mode::automatic);
  bench.request = made_before;
  bench.step();
  CHECK_FALSE(bench.holds());
  CHECK(bench.co == Approx(2.0).margin(0.1));
  CHECK(bench.phase() == MovePhase::watching);
}

TEST_CASE("a lost sample restarts planned moves", "[control][planned_moves]") {
  Bench bench(sticking_loop(0.01));
  bench.until(MovePhase::resting);
  bench.controller_step();
  bench.samples.clear();
  bench.step();
  CHECK(bench.phase() == MovePhase::watching);
  bench.step();
  CHECK_FALSE(bench.holds());
}

}  // namespace moves_advisor_test
