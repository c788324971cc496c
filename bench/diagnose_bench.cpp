// SPDX-License-Identifier: Apache-2.0
#include <benchmark/benchmark.h>

#include <vector>

#include "bench/plant1.hpp"
#include "model/diagnosis/diagnosis.hpp"
#include "model/plant/simulated_loop.hpp"

namespace loopwarden::bench {
namespace {

constexpr std::size_t kWindow = 1000;
constexpr std::size_t kEvery = 5;  // of the loop's samples, as a historian keeps them: 0.5 s

// One window of routine operation, as an engineer exports it.
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
  const diagnosis::RoutineRecord record{
      .pv = pv,
      .co = co,
      .sp = sp,
      .sample_time_s = model.sample_time_s * static_cast<double>(kEvery),
      .co_low = 0.0,
      .co_high = 10.0};
  for (auto _ : state) {
    const diagnosis::Diagnosis found = diagnosis::diagnose(record);
    // A gate that is shut would make a fast verdict.
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

}  // namespace
}  // namespace loopwarden::bench
