// SPDX-License-Identifier: Apache-2.0
#include <benchmark/benchmark.h>

#include <vector>

#include "lab/bench/plant1.hpp"
#include "model/diagnosis/diagnosis.hpp"
#include "model/watch/limits.hpp"
#include "model/watch/routine_watch.hpp"
#include "model/plant/simulated_loop.hpp"

namespace loopwarden::bench {
namespace {

constexpr std::size_t kWindow = 1000;
constexpr std::size_t kEvery = 5;  // of the loop's samples, as stored by a historian: 0.5 s

// Evaluates one window of routine operation, as an engineer exports it.
void judge_window(benchmark::State& state, const plant::LoopModel& model) {
  plant::SimulatedLoop loop(model, 10.0 / 4096.0);
  std::vector<double> sp, pv, co;
  for (std::size_t k = 0; k < kWindow * kEvery; ++k) {
    const plant::LoopSample sample = loop.step();
    if (k % kEvery != 0) continue;
    sp.push_back(sample.sp);
    pv.push_back(sample.pv);
    co.push_back(sample.co);
  }
  const numeric::LoopView record{.period_s = model.sample_time_s * static_cast<double>(kEvery),
                                 .pv = pv,
                                 .sp = sp,
                                 .co = co,
                                 .co_low = 0.0,
                                 .co_high = 10.0};
  for (auto _ : state) {
    const diagnosis::Diagnosis found = diagnosis::diagnose(record);
    // A closed gate would make the verdict too fast.
    if (found.prepared.gate != diagnosis::Gate::open) state.SkipWithError("record refused");
    benchmark::DoNotOptimize(found.probability);
  }
}

plant::LoopModel moved(plant::LoopModel model) {
  model.controller.jacket.form = control::JacketForm::off;
  model.scenario.set_point = {{0.0, 5.0}, {150.0, 6.0}, {300.0, 4.0}, {420.0, 5.5}};
  return model;
}

void sticking_window(benchmark::State& state) { judge_window(state, moved(sticking_plant1())); }
BENCHMARK(sticking_window)->Name("diagnose/sticking");

void healthy_window(benchmark::State& state) { judge_window(state, moved(plant1())); }
BENCHMARK(healthy_window)->Name("diagnose/healthy");

// Does the work of the monitor's thread for a loop every 12.5 minutes, when its levels of samples
// are full.
void routine_evidence(benchmark::State& state) {
  const plant::LoopModel model = moved(sticking_plant1());
  constexpr double kSample = 1.0;  // s, of the first level
  const auto every = static_cast<std::size_t>(kSample / model.sample_time_s);
  plant::SimulatedLoop loop(model, 10.0 / 4096.0);
  watch::RoutineWatch watch({.sample_time_s = kSample, .pv_high = 10.0, .co_high = 10.0});
  std::uint64_t period = 0;
  for (auto _ : state) {
    state.PauseTiming();
    bool judged = false;
    while (!judged) {
      plant::LoopSample sample = loop.step();
      for (std::size_t k = 1; k < every; ++k) sample = loop.step();
      const watch::Cycle cycle{.period_index = ++period,
                               .sp = sample.sp,
                               .pv = sample.pv,
                               .co = sample.co,
                               .automatic = true,
                               .pv_good = true};
      if (period % watch::WatchLimits::kRoutineSamples != 0) {
        judged = watch.add(cycle);
        continue;
      }
      state.ResumeTiming();
      judged = watch.add(cycle);
    }
  }
}
BENCHMARK(routine_evidence)->Name("diagnose/routine")->Iterations(64);

}  // namespace
}  // namespace loopwarden::bench
