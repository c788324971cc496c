// SPDX-License-Identifier: Apache-2.0
#include <benchmark/benchmark.h>

#include "lab/bench/plant1.hpp"
#include "model/plant/simulated_loop.hpp"

namespace loopwarden::bench {
namespace {

// Measures one sample of the whole loop: controller, stiction, process, noise, 12-bit transmitter.
void simulate_full_loop(benchmark::State& state) {
  plant::LoopModel model = sticking_plant1();
  model.controller.jacket.form = control::JacketForm::off;
  plant::SimulatedLoop loop(model);
  for (auto _ : state) {
    for (int i = 0; i < 1000; ++i) benchmark::DoNotOptimize(loop.step());
  }
  state.SetItemsProcessed(state.iterations() * 1000);
}
BENCHMARK(simulate_full_loop)->Name("simulate/full_loop");

}  // namespace
}  // namespace loopwarden::bench
