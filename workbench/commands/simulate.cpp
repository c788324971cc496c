// SPDX-License-Identifier: Apache-2.0
// loopwarden simulate: simulates a loop model in closed loop and writes a record.
#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "record/record_csv.hpp"
#include "model/analysis/loop_metrics.hpp"
#include "model/plant/simulated_loop.hpp"
#include "workbench/command_line/frame.hpp"
#include "workbench/files/model_file.hpp"
#include "workbench/files/output_files.hpp"
#include "workbench/command_line/progress.hpp"
#include "workbench/commands/subcommands.hpp"

namespace loopwarden::workbench {
namespace {

struct SimulateOptions {
  std::string model;
  std::string out;
  std::optional<double> duration_s;
  std::optional<std::uint64_t> seed;
  std::optional<double> output_bits;
  bool truth = false;
  bool json = false;
};

struct Run {
  std::vector<double> sp, pv, stem;
};

// Returns the CO units per step of a converter with `bits`; 0 without a converter.
double resolution_of(const plant::LoopModel& model, std::optional<double> bits) {
  if (!bits) return 0.0;
  const control::PidSettings& pid = model.controller.pid;
  return pid.output_span() / std::exp2(*bits);
}

Run simulate(const plant::LoopModel& model, const SimulateOptions& options,
             record::RecordCsvWriter& writer) {
  plant::SimulatedLoop loop(model, resolution_of(model, options.output_bits));
  const auto samples = static_cast<std::uint64_t>(
                           std::floor(model.scenario.duration_s / model.sample_time_s + 1e-9)) +
                       1;
  Progress progress("simulate", samples);
  Run run;
  for (std::uint64_t k = 0; k < samples; ++k) {
    const plant::LoopSample s = loop.step();
    const std::array<double, 2> truth{s.true_pv, s.severity};
    writer.add({.time_s = s.time_s, .pv = s.pv, .sp = s.sp, .co = s.co, .stem = s.stem},
               options.truth ? std::span<const double>(truth) : std::span<const double>());
    run.sp.push_back(s.sp);
    run.pv.push_back(s.pv);
    run.stem.push_back(s.stem);
    if (k % 4096 == 0) progress.update(k);
  }
  return run;
}

void report(const plant::LoopModel& model, const SimulateOptions& options, const Run& run) {
  const analysis::LoopMetrics m =
      analysis::loop_metrics(run.sp, run.pv, run.stem, model.sample_time_s, 0.0);
  if (options.json) {
    const nlohmann::json result = {{"record", options.out},
                                   {"samples", run.pv.size()},
                                   {"seed", model.scenario.seed},
                                   {"rms_error", m.rms_error},
                                   {"mean_error", m.mean_error},
                                   {"amplitude", m.amplitude},
                                   {"period_s", m.period_s},
                                   {"travel_per_hour", m.travel_per_hour},
                                   {"reversals_per_hour", m.reversals_per_hour}};
    show_json(result);
    return;
  }
  fmt::print("{}: {} samples of {:g} s, {:.1f} s, seed {}\n", options.out, run.pv.size(),
             model.sample_time_s, static_cast<double>(run.pv.size()) * model.sample_time_s,
             model.scenario.seed);
  fmt::print(
      "SP - PV: RMS {:.4g} PV units, mean {:.4g} PV units\nPV: amplitude {:.4g} PV units{}\n",
      m.rms_error, m.mean_error, m.amplitude,
      m.period_s > 0.0 ? fmt::format(", period {:.4g} s", m.period_s) : std::string());
  fmt::print("stem: travel {:.5g} CO units/h, {:.0f} reversals/h\n", m.travel_per_hour,
             m.reversals_per_hour);
}

int run_simulate(const SimulateOptions& options) {
  plant::LoopModel model = load_model(options.model);
  if (options.duration_s) model.scenario.duration_s = *options.duration_s;
  if (options.seed) model.scenario.seed = *options.seed;
  OutputFiles files({options.model});
  try {
    record::RecordColumns columns;
    if (options.truth) columns.more = {"true_pv", "fault_severity"};
    record::RecordCsvWriter writer(files.stage(options.out), columns);
    const Run run = simulate(model, options, writer);
    writer.finish();
    files.commit();
    report(model, options, run);
  } catch (const record::RecordError& e) {
    fail(kExitIo, "{}", files.in_users_words(e.what()));
  }
  return kExitOk;
}

}  // namespace

void add_simulate(Program& program) {
  auto [command, o] = program.command(
      "simulate", "Simulate a loop model in closed loop and write a record", run_simulate);
  command.required("model", o.model, "loop model, YAML");
  command.required("--out", o.out, "record to write, CSV");
  command.option("--duration", o.duration_s, "duration, s; default: the scenario's",
                 between(0.0, 1e9));
  command.option("--seed", o.seed, "seed of the noise; default: the scenario's");
  command.option("--output-bits", o.output_bits, "resolution of CO, bits over its range",
                 between(1.0, 32.0));
  command.flag("--truth", o.truth, "also write true_pv and fault_severity");
  command.flag("--json", o.json, "print the result as JSON");
  command.footer("Example: loopwarden simulate examples/models/plant1.yaml --out run.csv --seed 7");
}

}  // namespace loopwarden::workbench
