// SPDX-License-Identifier: Apache-2.0
#include "workbench/commands/bench_options.hpp"

#include "workbench/command_line/frame.hpp"
#include "workbench/files/model_file.hpp"

namespace loopwarden::workbench {

void check_limits(const BenchOptions& options) {
  const auto upside_down = [](const std::optional<double>& low, const std::optional<double>& high) {
    return low && high && !(*low < *high);
  };
  if (options.live && !(options.low && options.high && options.pv_low && options.pv_high)) {
    fail(kExitUsage, "--live needs --low, --high, --pv-low and --pv-high");
  }
  if (upside_down(options.low, options.high) || upside_down(options.pv_low, options.pv_high)) {
    fail(kExitUsage, "--low must be below --high, and --pv-low below --pv-high");
  }
}

std::unique_ptr<TestBench> bench_of(const BenchOptions& options) {
  if (options.live) {
    return std::make_unique<LiveBench>(
        options.socket, options.target,
        LiveLimits{*options.low, *options.high, *options.pv_low, *options.pv_high});
  }
  plant::LoopModel model = load_model(options.target);
  // Faults act from the start and at full severity, because a test does not wait for them.
  for (plant::ScheduledFault& fault : model.scenario.faults) fault.schedule = {};
  return std::make_unique<SimulatedBench>(model);
}

void add_bench_options(Command& command, BenchOptions& options) {
  command.socket(options.socket);
  command.option("--low", options.low, "lowest output of the test, CO units");
  command.option("--high", options.high, "highest output of the test, CO units");
  command.option("--pv-low", options.pv_low, "PV units, below it the test ends");
  command.option("--pv-high", options.pv_high, "PV units, above it the test ends");
  command.flag("--live", options.live,
               "test a loop of the running daemon: it is restored afterwards");
}

}  // namespace loopwarden::workbench
