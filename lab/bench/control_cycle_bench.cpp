// SPDX-License-Identifier: Apache-2.0
#include <benchmark/benchmark.h>

#include <memory>
#include <vector>

#include "lab/bench/plant1.hpp"
#include "lab/bench/bench_loop.hpp"
#include "model/control/moves_advisor.hpp"

namespace loopwarden::bench {
namespace {

struct Loop {
  explicit Loop(const plant::LoopModel& model) : loop(model, events) {}

  void run(std::uint64_t period) {
    const auto now_ns = static_cast<std::int64_t>(period) * 100'000'000;
    loop.cycle.run({.now_ns = now_ns, .period_index = period}, 0, false);
    control::MovesSample sample;
    while (loop.channels.moves_samples.try_pop(sample)) {
      loop.channels.moves_requests.publish(moves.step(sample));
    }
    record::RecordRow row;
    loop.channels.records.try_pop(row);  // emptied as by the historian, so that the ring does not
                                         // fill
    benchmark::DoNotOptimize(row);
  }

  base::SpscRing<daemon::rt::Event> events{256};
  BenchLoop loop;
  control::MovesAdvisor moves{0.1, 50};
};

void cycle_of(benchmark::State& state, const plant::LoopModel& model) {
  Loop loop(model);
  std::uint64_t period = 0;
  for (auto _ : state) loop.run(period++);
}
void cycle_healthy(benchmark::State& state) { cycle_of(state, plant1()); }
void cycle_sticking(benchmark::State& state) { cycle_of(state, sticking_plant1()); }
// Engaged: the cost above that of the healthy cycle is the cost of planned_moves, in the cycle and
// on the monitor's thread.
void cycle_calmed(benchmark::State& state) {
  Loop loop(calmed_plant1());
  std::uint64_t period = 0;
  const auto watches = [&] {
    return loop.moves.state().value_or(control::MovesState{}).phase == control::MovePhase::watching;
  };
  while (watches() && period < 100'000) loop.run(period++);
  for (auto _ : state) loop.run(period++);
}
BENCHMARK(cycle_calmed)->Name("control_cycle/planned_moves");
BENCHMARK(cycle_healthy)->Name("control_cycle/healthy");
BENCHMARK(cycle_sticking)->Name("control_cycle/sticking");

// One round over all loops. Their state is larger than the caches of one loop.
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
