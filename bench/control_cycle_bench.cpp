// SPDX-License-Identifier: Apache-2.0
#include <benchmark/benchmark.h>

#include <memory>
#include <vector>

#include "bench/plant1.hpp"
#include "daemon/rt/control_cycle.hpp"
#include "hal/sim/sim_loop_io.hpp"

namespace loopwarden::bench {
namespace {

// A loop as the daemon runs it, without the threads around it.
struct Loop {
  explicit Loop(const plant::LoopModel& model)
      : io(hal::sim::SimSettings{
            .model = model, .output_resolution = 10.0 / 4096.0, .io_faults = {}}),
        channels(64),
        cycle(0, model.sample_time_s, settings(model),
              {.mode = control::Mode::automatic, .set_point = 5.0, .output = {}},
              daemon::rt::ValvePositionSource::read_back, {}, io, channels, events) {}

  static daemon::rt::LoopSettings settings(const plant::LoopModel& model) {
    daemon::rt::LoopSettings s;
    s.controller = model.controller;
    s.pv_check.high = 10.0;
    return s;
  }

  void run(std::uint64_t period) {
    const auto now_ns = static_cast<std::int64_t>(period) * 100'000'000;
    cycle.run({.now_ns = now_ns, .period_index = period}, 0, false);
    hal::record::RecordRow row;
    channels.records.try_pop(row);  // as the historian would, so that the ring does not fill
    benchmark::DoNotOptimize(row);
  }

  hal::sim::SimLoopIo io;
  daemon::rt::LoopChannels channels;
  hal::os::SpscRing<daemon::rt::Event> events{256};
  daemon::rt::ControlCycle cycle;
};

void cycle_of(benchmark::State& state, const plant::LoopModel& model) {
  Loop loop(model);
  std::uint64_t period = 0;
  for (auto _ : state) loop.run(period++);
}
void cycle_healthy(benchmark::State& state) { cycle_of(state, plant1()); }
void cycle_sticking(benchmark::State& state) { cycle_of(state, sticking_plant1()); }
BENCHMARK(cycle_healthy)->Name("control_cycle/healthy");
BENCHMARK(cycle_sticking)->Name("control_cycle/sticking");

// One round over all loops, their state larger than the caches of one loop.
void all_loops(benchmark::State& state, std::size_t count) {
  std::vector<std::unique_ptr<Loop>> loops;
  for (std::size_t i = 0; i < count; ++i)
    loops.push_back(std::make_unique<Loop>(sticking_plant1()));
  std::uint64_t period = 0;
  for (auto _ : state) {
    for (auto& loop : loops) loop->run(period);
    ++period;
  }
}
void all_1000(benchmark::State& state) { all_loops(state, 1000); }
void all_100(benchmark::State& state) { all_loops(state, 100); }
BENCHMARK(all_1000)->Name("all_loops/1000_at_10Hz");
BENCHMARK(all_100)->Name("all_loops/100_at_100Hz");

}  // namespace
}  // namespace loopwarden::bench
