// SPDX-License-Identifier: Apache-2.0
// loopwarden autotune: finds controller settings by the relay experiment.
#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "model/analysis/relay_test.hpp"
#include "workbench/command_line/frame.hpp"
#include "workbench/commands/bench_options.hpp"
#include "workbench/commands/subcommands.hpp"

namespace loopwarden::workbench {
namespace {

using nlohmann::json;

struct AutotuneOptions {
  BenchOptions bench;
  std::optional<double> amplitude, hysteresis;
  double time_limit_s = 1800.0;
  std::string action;  // empty: of the loop or model
  bool json = false;
};

// With the wrong action, the relay drives PV away from its target.
control::Action action_of(const AutotuneOptions& options, const TestBench& bench) {
  const bool direct = bench.action() == control::Action::direct;
  if (!options.action.empty() && (options.action == "direct") != direct) {
    throw TestAborted(fmt::format("--action {}: the controller's action is {}", options.action,
                                  direct ? "direct" : "reverse"));
  }
  return bench.action();
}

int run_autotune(const AutotuneOptions& options) {
  check_limits(options.bench);
  std::optional<analysis::RelayResult> found;
  try {
    const std::unique_ptr<TestBench> bench = bench_of(options.bench);
    const control::Action action = action_of(options, *bench);
    const double span = bench->output_high() - bench->output_low();
    const double amplitude = options.amplitude.value_or(0.05 * span);
    const double low = options.bench.low.value_or(bench->output_low());
    const double high = options.bench.high.value_or(bench->output_high());
    if (bench->output() - amplitude < low || bench->output() + amplitude > high) {
      throw TestAborted(
          fmt::format("the relay's outputs, {:.4g} -+ {:.4g}, leave the limits {:g} to {:g}",
                      bench->output(), amplitude, low, high));
    }
    // First measures the loop's noise at its present output.
    const std::vector<BenchRow> quiet = bench->hold(bench->output(), 50.0 * bench->sample_time_s());
    double mean = 0.0;
    double squares = 0.0;
    for (std::size_t k = 0; k < quiet.size(); ++k) {
      mean += quiet[k].pv / static_cast<double>(quiet.size());
      if (k > 0) squares += std::pow(quiet[k].pv - quiet[k - 1].pv, 2) / 2.0;
    }
    const double noise = std::sqrt(squares / static_cast<double>(quiet.size()));
    analysis::RelayTest relay({.output = bench->output(),
                               .amplitude = amplitude,
                               .target = mean,
                               .hysteresis = options.hysteresis.value_or(4.0 * noise),
                               .action = action});
    double co = relay.step(quiet.back().time_s, quiet.back().pv);
    const double until_s = quiet.back().time_s + options.time_limit_s;
    while (!relay.result()) {
      for (const BenchRow& row : bench->hold(co, bench->sample_time_s())) {
        co = relay.step(row.time_s, row.pv);
        if (row.time_s > until_s) throw TestAborted("no steady cycle within the time limit");
        if (relay.result()) break;
      }
    }
    found = relay.result();
  } catch (const TestAborted& e) {
    fail(kExitTryAgain, "{}: autotune ended: {}", options.bench.target, e.what());
  }
  const control::PidGains calm = found->tyreus_luyben();
  const control::PidGains lively = found->ziegler_nichols();
  if (options.json) {
    const json result = {{"ultimate_gain", found->ultimate_gain},
                         {"ultimate_period_s", found->ultimate_period_s},
                         {"pv_amplitude", found->amplitude},
                         {"periods", found->periods},
                         {"tyreus_luyben", {{"kp", calm.kp}, {"ki", calm.ki}}},
                         {"ziegler_nichols", {{"kp", lively.kp}, {"ki", lively.ki}}}};
    show_json(result);
    return kExitOk;
  }
  fmt::print("ultimate gain {:.4g}, ultimate period {:.4g} s (PV +-{:.4g}, {} periods)\n",
             found->ultimate_gain, found->ultimate_period_s, found->amplitude, found->periods);
  fmt::print("Recommended (Tyreus and Luyben):\n  kp: {:.5g}\n  ki: {:.5g}\n", calm.kp, calm.ki);
  fmt::print(
      "Livelier (Ziegler and Nichols): kp {:.4g}, ki {:.4g}\nNothing was changed: the settings go "
      "into the loop's file.\n",
      lively.kp, lively.ki);
  return kExitOk;
}

}  // namespace

void add_autotune(Program& program) {
  auto [command, o] = program.command(
      "autotune", "Find controller settings by a relay experiment, simulated or live",
      run_autotune);
  command.required("target", o.bench.target, "loop model, YAML; with --live the tag of a loop");
  add_bench_options(command, o.bench);
  command.option("--amplitude", o.amplitude,
                 "amplitude of the relay, CO units; default: 5 % of the range", above_zero());
  command.option("--hysteresis", o.hysteresis,
                 "hysteresis of the relay, PV units; default: four times the noise of PV",
                 not_below_zero());
  command.setting("--time-limit", o.time_limit_s, "s of the loop's time", above_zero());
  command.option("--action", o.action,
                 "action of the controller; refused if the loop or model has the other one",
                 one_of({"reverse", "direct"}));
  command.flag("--json", o.json, "print the result as JSON");
  command.footer(
      "Example: loopwarden autotune FIC-101 --live --low 3 --high 5 --pv-low 2 --pv-high 8 "
      "--amplitude 0.5");
}

}  // namespace loopwarden::workbench
