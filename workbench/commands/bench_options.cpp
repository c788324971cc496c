// SPDX-License-Identifier: Apache-2.0
#include "workbench/commands/bench_options.hpp"

#include <fmt/format.h>

#include "workbench/command_line/command_line.hpp"
#include "workbench/files/model_file.hpp"

namespace loopwarden::workbench {

std::unique_ptr<TestBench> bench_of(const BenchOptions& options) {
  if (options.live) {
    return std::make_unique<LiveBench>(
        options.socket, options.target,
        LiveLimits{*options.low, *options.high, *options.pv_low, *options.pv_high});
  }
  auto model = load_model(options.target);
  if (!model) return nullptr;
  // Faults count from the start and at full severity: a test does not wait for them.
  for (plant::ScheduledFault& fault : model->scenario.faults) fault.schedule = {};
  return std::make_unique<SimulatedBench>(*model);
}

void add_bench_options(CLI::App& sub, BenchOptions& options) {
  sub.add_option("target", options.target, "loop model, YAML; with --live the tag of a loop")
      ->required();
  add_socket_option(sub, options.socket);
  auto* low = sub.add_option("--low", options.low, "CO units, least output of the test");
  auto* high = sub.add_option("--high", options.high, "CO units, largest output of the test");
  auto* pv_low = sub.add_option("--pv-low", options.pv_low, "PV units, below it the test ends");
  auto* pv_high = sub.add_option("--pv-high", options.pv_high, "PV units, above it the test ends");
  sub.add_flag("--live", options.live,
               "on a loop of the running daemon: takes it to manual and puts it back afterwards")
      ->needs(low)
      ->needs(high)
      ->needs(pv_low)
      ->needs(pv_high);
}

bool limits_make_sense(const BenchOptions& options) {
  const auto upside_down = [](const std::optional<double>& low, const std::optional<double>& high) {
    return low && high && !(*low < *high);
  };
  if (upside_down(options.low, options.high) || upside_down(options.pv_low, options.pv_high)) {
    fmt::print(stderr, "--low must be below --high, and --pv-low below --pv-high\n");
    return false;
  }
  return true;
}

}  // namespace loopwarden::workbench
