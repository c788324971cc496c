// SPDX-License-Identifier: Apache-2.0
#include "hal/sim/sim_loop_io.hpp"

#include <catch2/catch.hpp>

namespace sim_loop_io_test {

using namespace loopwarden;
using hal::Limit;

TEST_CASE("the simulated transmitter reports an end of its range", "[sim]") {
  plant::LoopModel model;
  model.controller.pid.output_high = 10.0;
  model.process = {.gain = 2.0, .time_constant_s = 0.5, .dead_time_s = 0.0};
  model.transmitter = {.low = 0.0, .high = 10.0, .resolution = 0.01, .noise = 0.0};
  hal::sim::SimLoopIo io({.model = model, .output_resolution = 0.0, .io_faults = {}});
  std::uint64_t period = 0;
  const auto settled_at = [&](double output) {
    hal::Inputs inputs;
    for (int k = 0; k < 100; ++k) {
      const hal::CycleTime time{.now_ns = static_cast<std::int64_t>(++period) * 100'000'000,
                                .period_index = period};
      io.read(time, inputs);
      io.write(time, {.output = output, .time_ns = time.now_ns, .write = true, .alarm = false});
    }
    return inputs.process_variable;
  };
  CHECK(settled_at(3.0).limit == Limit::none);
  const hal::Sample beyond = settled_at(8.0);  // the process is at 16
  CHECK(beyond.value == Approx(10.0));
  CHECK(beyond.limit == Limit::high);
  CHECK(beyond.quality == hal::Quality::good);
  CHECK(settled_at(0.0).limit == Limit::low);
  CHECK(settled_at(0.5).limit == Limit::none);
}

TEST_CASE("before the first command the simulated valve doesn't move", "[sim]") {
  plant::LoopModel model;
  model.controller.pid.output_high = 10.0;
  model.process = {.gain = 2.0, .time_constant_s = 0.5, .dead_time_s = 0.0};
  model.transmitter = {.low = 0.0, .high = 10.0, .resolution = 0.0, .noise = 0.0};
  model.scenario.set_point = {{0.0, 6.0}};
  hal::sim::SimLoopIo io({.model = model, .output_resolution = 0.0, .io_faults = {}});
  hal::Inputs inputs;
  const auto run = [&](double output, bool write, std::uint64_t from) {
    for (std::uint64_t period = from; period < from + 50; ++period) {
      const hal::CycleTime time{.now_ns = static_cast<std::int64_t>(period) * 100'000'000,
                                .period_index = period};
      io.read(time, inputs);
      io.write(time, {.output = output, .time_ns = time.now_ns, .write = write, .alarm = false});
    }
  };
  run(9.0, false, 0);
  CHECK(inputs.valve_position.value == Approx(3.0));
  CHECK(io.counters().writes == 0);
  run(9.0, true, 50);
  CHECK(inputs.valve_position.value == Approx(9.0));
}

}  // namespace sim_loop_io_test
