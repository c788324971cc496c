// SPDX-License-Identifier: Apache-2.0
#include <benchmark/benchmark.h>

#include <vector>

#include "lab/bench/plant1.hpp"
#include "model/watch/loop_monitor.hpp"
#include "model/plant/simulated_loop.hpp"

namespace loopwarden::bench {
namespace {

constexpr std::size_t kCycles = 3000;

// Measures a commissioned loop of another controller at 1 s: twin, its controller, load and routine
// evidence.
void watched_loop(benchmark::State& state) {
  plant::LoopModel twin = plant1();
  twin.sample_time_s = 1.0;
  twin.process.time_constant_s = 15.0;
  twin.controller.pid.gains = {.kp = 0.3, .ki = 0.02};
  twin.scenario.set_point = {{0.0, 5.0}};
  for (double t = 120.0; t < static_cast<double>(kCycles); t += 120.0) {
    twin.scenario.set_point.emplace_back(t,
                                         twin.scenario.set_point.back().second == 5.0 ? 6.0 : 5.0);
  }
  twin.twin.emplace();
  twin.twin->seen_low = 0.0;
  twin.twin->seen_high = 10.0;
  twin.twin->co_low = 0.0;
  twin.twin->co_high = 10.0;
  twin.twin->load = plant::SeenLoad{.mean = 0.0, .deviation = 0.05, .step = 0.05};
  twin.twin->controller = plant::SeenController{.rms = 0.003, .resolution = 10.0 / 4096.0};
  plant::SimulatedLoop loop(twin, 10.0 / 4096.0);
  std::vector<plant::LoopSample> samples;
  for (std::size_t k = 0; k < kCycles; ++k) samples.push_back(loop.step());
  watch::LoopMonitor watch({.sample_time_s = 1.0, .pv_high = 10.0, .co_high = 10.0},
                           alarm::kAlarmRule, nullptr, &twin);
  std::uint64_t period = 0;
  for (auto _ : state) {
    for (const plant::LoopSample& s : samples) {
      const watch::MonitorStep step = watch.add({.period_index = ++period,
                                                 .sp = s.sp,
                                                 .pv = s.pv,
                                                 .co = s.co,
                                                 .automatic = true,
                                                 .pv_good = true});
      benchmark::DoNotOptimize(step.twin);
    }
  }
  if (!watch.controller()->watched()) state.SkipWithError("the controller is not watched");
}
BENCHMARK(watched_loop)->Name("monitor/commissioned");

}  // namespace
}  // namespace loopwarden::bench
