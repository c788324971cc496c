// SPDX-License-Identifier: Apache-2.0
// loopwarden valve-test: tests of a valve with its loop in manual. loopwarden autotune: the relay experiment.
#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "model/analysis/relay_test.hpp"
#include "model/analysis/valve_test.hpp"
#include "workbench/chart.hpp"
#include "workbench/command_line.hpp"
#include "workbench/files.hpp"
#include "workbench/json_number.hpp"
#include "workbench/output_files.hpp"
#include "workbench/subcommands.hpp"
#include "workbench/test_bench.hpp"

namespace loopwarden::workbench {
namespace {

using analysis::ValveTest;
using nlohmann::json;

// What both commands need to know about where they work.
struct BenchOptions {
  std::string target;  // model file, or the loop's tag with --live
  std::string socket;
  bool live = false;
  std::optional<double> low, high;        // CO units
  std::optional<double> pv_low, pv_high;  // PV units
};

struct ValveTestOptions {
  BenchOptions bench;
  std::vector<std::string> tests;
  std::optional<double> hold_s;
  std::optional<double> gain;  // PV units / CO unit, where there is no read-back
  std::string out;
  std::string commissioning;
  bool json = false;
};

struct TestResult {
  ValveTest test;
  analysis::ValveFigures figures;
  std::vector<double> time_s, co, position;
};

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

// Ends with the exit code if the bench's limits are no limits.
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

TestResult run_test(TestBench& bench, ValveTest test, const ValveTestOptions& options,
                    const analysis::ValveTestSettings& settings) {
  TestResult result{.test = test, .figures = {}, .time_s = {}, .co = {}, .position = {}};
  std::vector<analysis::HeldPosition> holds;
  double noise = 0.0;
  double count = 0.0;
  for (const analysis::Hold& hold : analysis::plan(test, settings)) {
    const std::vector<BenchRow> rows = bench.hold(hold.output, hold.seconds);
    analysis::HeldPosition held{.output = hold.output, .position = {}};
    for (const BenchRow& row : rows) {
      double at = row.stem;
      if (!std::isfinite(at)) {
        if (!options.gain) {
          throw TestAborted("the loop has no read-back; state its gain (--gain, PV units/CO unit)");
        }
        at = bench.output() + (row.pv - bench.process_variable()) / *options.gain;
      }
      held.position.push_back(at);
      result.time_s.push_back(row.time_s);
      result.co.push_back(row.co);
      result.position.push_back(at);
    }
    // Noise by neighbours at the end of a hold.
    for (std::size_t k = held.position.size() - held.position.size() / 3;
         k > 0 && k < held.position.size(); ++k) {
      const double change = held.position[k] - held.position[k - 1];
      noise += change * change / 2.0;
      count += 1.0;
    }
    holds.push_back(std::move(held));
  }
  const double deviation = count > 0.0 ? std::sqrt(noise / count) : 0.0;
  // Half of the smallest step of the study, or what noise makes of a mean.
  const double moved = std::max(0.0005 * settings.span, 1.5 * deviation);
  result.figures = analysis::figures(test, settings, holds, moved);
  return result;
}

Chart chart_of(const TestResult& r) {
  const bool scan = r.test == ValveTest::static_scan || r.test == ValveTest::dynamic_scan;
  Chart chart{.title = analysis::to_text(r.test),
              .x_label = scan ? "CO" : "s",
              .y_label = scan ? "position" : "CO, position",
              .lines = {},
              .width = 560.0,
              .height = 260.0};
  if (scan) {
    // From the first turn on: the way there is no branch.
    chart.lines.push_back({"signature", "#0072b2", r.co, r.position});
    chart.lines.push_back({"CO", "#7a828c", r.co, r.co, true});
  } else {
    std::vector<double> t;
    for (const double time : r.time_s) t.push_back(time - r.time_s.front());
    chart.lines.push_back({"CO", "#7a828c", t, r.co, true});
    chart.lines.push_back({"position", "#0072b2", t, r.position});
  }
  return chart;
}

json as_json(const std::vector<TestResult>& results, const ValveTestOptions& options) {
  json tests = json::object();
  for (const TestResult& r : results) {
    json values = json::object();
    for (const auto& [name, value] : r.figures) values[name] = finite_or_null(value);
    tests[analysis::to_text(r.test)] = std::move(values);
  }
  const std::time_t now = std::time(nullptr);
  return {{"target", options.bench.target},
          {"live", options.bench.live},
          {"finished_utc", fmt::format("{:%FT%TZ}", *std::gmtime(&now))},
          {"tests", std::move(tests)}};
}

// The figure of the commissioning run, if it has one.
std::optional<double> before_of(const json& commissioning, ValveTest test,
                                const std::string& name) {
  const json& tests = commissioning.value("tests", json::object());
  const auto it = tests.find(analysis::to_text(test));
  if (it == tests.end() || !it->contains(name) || !(*it)[name].is_number()) return std::nullopt;
  return (*it)[name].get<double>();
}

std::string figure(double value) {
  return std::isfinite(value) ? fmt::format("{:.4g}", value) : std::string("above 5 %");
}

void print_text(const std::vector<TestResult>& results, const json& commissioning) {
  for (const TestResult& r : results) {
    fmt::print("{}\n", analysis::to_text(r.test));
    for (const auto& [name, value] : r.figures) {
      const std::optional<double> before = before_of(commissioning, r.test, name);
      fmt::print("  {:<34} {:>10}{}\n", name, figure(value),
                 before ? fmt::format("   at commissioning {:.4g}", *before) : std::string());
    }
  }
}

std::string page(const std::vector<TestResult>& results, const json& commissioning,
                 const std::string& target) {
  std::string body;
  for (const TestResult& r : results) {
    body +=
        fmt::format("<h2>{}</h2>\n{}<table><tr><th></th><th>now</th><th>commissioning</th></tr>",
                    analysis::to_text(r.test), chart_svg(chart_of(r)));
    for (const auto& [name, value] : r.figures) {
      const std::optional<double> before = before_of(commissioning, r.test, name);
      body += fmt::format("<tr><td>{}</td><td>{}</td><td>{}</td></tr>\n", escaped(name),
                          figure(value), before ? fmt::format("{:.4g}", *before) : "-");
    }
    body += "</table>\n";
  }
  return html_page("Valve test of " + target, body);
}

int run_valve_test(const ValveTestOptions& options) {
  if (!limits_make_sense(options.bench)) return kExitUsage;
  json commissioning = json::object();
  if (!options.commissioning.empty()) {
    std::ifstream file(options.commissioning);
    commissioning = json::parse(file, nullptr, false);
    if (!commissioning.is_object()) {
      fmt::print(stderr, "{}: is no result of valve-test\n", options.commissioning);
      return kExitData;
    }
  }
  std::vector<TestResult> results;
  try {
    const std::unique_ptr<TestBench> bench = bench_of(options.bench);
    if (!bench) return kExitConfiguration;
    const double span = bench->output_high() - bench->output_low();
    const analysis::ValveTestSettings settings{
        .low = options.bench.low.value_or(bench->output_low() + 0.1 * span),
        .high = options.bench.high.value_or(bench->output_high() - 0.1 * span),
        .span = span,
        .hold_s = options.hold_s.value_or(20.0),
        .sample_time_s = bench->sample_time_s()};
    for (const ValveTest test : analysis::kValveTests) {
      const bool wanted =
          options.tests.empty() || std::find(options.tests.begin(), options.tests.end(),
                                             analysis::to_text(test)) != options.tests.end();
      if (wanted) results.push_back(run_test(*bench, test, options, settings));
    }
  } catch (const TestAborted& e) {
    fmt::print(stderr, "{}: test ended: {}\n", options.bench.target, e.what());
    return kExitTryAgain;
  }
  const json result = as_json(results, options);
  if (!options.out.empty()) {
    const std::filesystem::path folder = options.out;
    OutputFiles files({options.commissioning, options.bench.live ? "" : options.bench.target});
    files.make_folder(folder);
    files.add(folder / "valve-test.json", result.dump(2) + "\n");
    files.add(folder / "report.html", page(results, commissioning, options.bench.target));
    files.commit();
  }
  if (options.json) {
    fmt::print("{}\n", result.dump(2));
  } else {
    print_text(results, commissioning);
  }
  return kExitOk;
}

struct AutotuneOptions {
  BenchOptions bench;
  std::optional<double> amplitude, hysteresis;
  double time_limit_s = 1800.0;
  std::string action = "reverse";
  bool json = false;
};

int run_autotune(const AutotuneOptions& options) {
  if (!limits_make_sense(options.bench)) return kExitUsage;
  std::optional<analysis::RelayResult> found;
  try {
    const std::unique_ptr<TestBench> bench = bench_of(options.bench);
    if (!bench) return kExitConfiguration;
    const double span = bench->output_high() - bench->output_low();
    const double amplitude = options.amplitude.value_or(0.05 * span);
    const double low = options.bench.low.value_or(bench->output_low());
    const double high = options.bench.high.value_or(bench->output_high());
    if (bench->output() - amplitude < low || bench->output() + amplitude > high) {
      throw TestAborted(
          fmt::format("the relay's outputs, {:.4g} -+ {:.4g}, leave the limits {:g} to {:g}",
                      bench->output(), amplitude, low, high));
    }
    // First the loop's own noise, at its own output.
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
                               .action = options.action == "direct" ? control::Action::direct
                                                                    : control::Action::reverse});
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
    fmt::print(stderr, "{}: autotune ended: {}\n", options.bench.target, e.what());
    return kExitTryAgain;
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
    fmt::print("{}\n", result.dump(2));
    return kExitOk;
  }
  fmt::print("ultimate gain {:.4g}, ultimate period {:.4g} s (PV +-{:.4g}, {} periods)\n",
             found->ultimate_gain, found->ultimate_period_s, found->amplitude, found->periods);
  fmt::print("Recommended (Tyreus and Luyben):\n  kp: {:.5g}\n  ki: {:.5g}\n", calm.kp, calm.ki);
  fmt::print(
      "Livelier (Ziegler and Nichols): kp {:.4g}, ki {:.4g}\nNothing was changed: the settings "
      "go into the loop's file.\n",
      lively.kp, lively.ki);
  return kExitOk;
}

}  // namespace

void add_valve_test(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<ValveTestOptions>();
  CLI::App* sub = app.add_subcommand(
      "valve-test", "step, ramp, resolution, scans and sines on a valve, simulated or live");
  add_bench_options(*sub, options->bench);
  std::vector<std::string> names;
  for (const ValveTest test : analysis::kValveTests) names.emplace_back(analysis::to_text(test));
  sub->add_option("--test", options->tests, "which; all without it")->check(CLI::IsMember(names));
  sub->add_option("--hold", options->hold_s, "s at each point, 20 without it")
      ->check(CLI::PositiveNumber);
  sub->add_option("--gain", options->gain,
                  "PV units/CO unit, to take the position from PV where there is no read-back");
  sub->add_option("--commissioning", options->commissioning,
                  "valve-test.json of an earlier run to compare with");
  sub->add_option("--out", options->out, "folder for valve-test.json and report.html");
  sub->add_flag("--json", options->json, "print the result as JSON");
  sub->footer(
      "Live, it needs --low, --high, --pv-low and --pv-high, and puts output, mode and set point "
      "back\n"
      "however it ends, also after Ctrl-C. Exit code 75: ended early.\n"
      "Example: loopwarden valve-test FIC-101 --live --low 3 --high 5 --pv-low 2 --pv-high 8 --out "
      "test");
  sub->callback([options, &exit_code] { exit_code = run_valve_test(*options); });
}

void add_autotune(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<AutotuneOptions>();
  CLI::App* sub = app.add_subcommand(
      "autotune", "controller settings from a relay experiment, simulated or live");
  add_bench_options(*sub, options->bench);
  sub->add_option("--amplitude", options->amplitude, "CO units, of the relay; 5 % of the range")
      ->check(CLI::PositiveNumber);
  sub->add_option("--hysteresis", options->hysteresis, "PV units; four times PV's noise")
      ->check(CLI::NonNegativeNumber);
  sub->add_option("--time-limit", options->time_limit_s, "s of the loop's time")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  sub->add_option("--action", options->action, "of the controller")
      ->check(CLI::IsMember({"reverse", "direct"}))
      ->capture_default_str();
  sub->add_flag("--json", options->json, "print the result as JSON");
  sub->footer(
      "Example: loopwarden autotune FIC-101 --live --low 3 --high 5 --pv-low 2 --pv-high 8 "
      "--amplitude 0.5");
  sub->callback([options, &exit_code] { exit_code = run_autotune(*options); });
}

}  // namespace loopwarden::workbench
