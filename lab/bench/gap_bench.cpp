// SPDX-License-Identifier: Apache-2.0
#include <benchmark/benchmark.h>

#include <algorithm>
#include <atomic>
#include <functional>
#include <thread>
#include <vector>

#include "lab/bench/plant1.hpp"
#include "model/gap/workflow.hpp"
#include "model/plant/simulated_loop.hpp"

namespace loopwarden::bench {
namespace {

constexpr std::size_t kSamples = 4200;  // seven minutes at 10 Hz
constexpr unsigned kThreads = 2;

// Returns a record of a sticking valve as stored by a historian.
numeric::LoopRecord sticking_record() {
  plant::LoopModel model = sticking_plant1();
  model.controller.jacket.form = control::JacketForm::off;
  model.valve_effects.front().parameters = {{"s", 1.0}, {"j", 0.5}};
  model.scenario.set_point = {{0.0, 3.0}, {20.0, 5.0}, {120.0, 4.0}, {220.0, 6.0}, {320.0, 4.5}};
  plant::SimulatedLoop loop(model, 10.0 / 4096.0);
  numeric::LoopRecord record;
  record.period_s = model.sample_time_s;
  for (std::size_t k = 0; k < kSamples; ++k) {
    const plant::LoopSample sample = loop.step();
    record.pv.push_back(sample.pv);
    record.sp.push_back(sample.sp);
    record.co.push_back(sample.co);
  }
  return record;
}

void two_threads(std::size_t count, const std::function<void(std::size_t)>& body) {
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t i = next++; i < count; i = next++) body(i);
  };
  std::vector<std::jthread> others;
  for (unsigned i = 1; i < kThreads; ++i) others.emplace_back(work);
  work();
}

// Measures the whole workflow, from a record and a model with a healthy valve to the corrected
// model. It takes seconds, so it runs once.
void whole_workflow(benchmark::State& state) {
  const numeric::LoopRecord record = sticking_record();
  const plant::LoopModel model = plant1();
  for (auto _ : state) {
    const gap::Result result = gap::find_gap(record, model, {}, two_threads, [](double) {});
    // A refused record would make the workflow too fast.
    if (!result.check.usable) state.SkipWithError("record refused");
  }
}
BENCHMARK(whole_workflow)->Name("gap/whole")->UseRealTime()->Iterations(1)->Repetitions(1);

}  // namespace
}  // namespace loopwarden::bench
