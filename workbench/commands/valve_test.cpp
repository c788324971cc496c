// SPDX-License-Identifier: Apache-2.0
// loopwarden valve-test: tests a valve with its loop in manual.
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

#include "model/analysis/valve_test.hpp"
#include "workbench/command_line/background.hpp"
#include "workbench/command_line/frame.hpp"
#include "workbench/commands/bench_options.hpp"
#include "workbench/commands/planned_valve_test.hpp"
#include "workbench/report/chart.hpp"
#include "workbench/text/json_number.hpp"
#include "workbench/files/output_files.hpp"
#include "workbench/commands/subcommands.hpp"

namespace loopwarden::workbench {
namespace {

using analysis::ValveTest;
using nlohmann::json;

struct ValveTestOptions {
  BenchOptions bench;
  std::vector<std::string> tests;
  std::optional<double> hold_s;
  std::optional<double> gain;  // PV units / CO unit, for a valve without read-back
  std::string out;
  std::string commissioning;
  std::string plan;    // next_test.yaml, in place of the tests
  std::string record;  // of a move that a person made
  bool background = false;
  std::string survey;  // folder that keeps the result of a plan
  bool json = false;
};

struct TestResult {
  ValveTest test;
  analysis::ValveFigures figures;
  std::vector<double> time_s, co, position;
};

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
    // Estimates the noise from neighbouring samples at the end of a hold.
    for (std::size_t k = held.position.size() - held.position.size() / 3;
         k > 0 && k < held.position.size(); ++k) {
      const double change = held.position[k] - held.position[k - 1];
      noise += change * change / 2.0;
      count += 1.0;
    }
    holds.push_back(std::move(held));
  }
  const double deviation = count > 0.0 ? std::sqrt(noise / count) : 0.0;
  // Half of the smallest step of the study, or the effect of noise on a mean.
  const double moved = std::max(0.0005 * settings.span, 1.5 * deviation);
  result.figures = analysis::figures(test, settings, holds, moved);
  return result;
}

Chart chart_of(const TestResult& r) {
  const bool scan = r.test == ValveTest::static_scan || r.test == ValveTest::dynamic_scan;
  Chart chart{.title = analysis::to_text(r.test),
              .x_label = scan ? "CO" : "s",
              .y_label = scan ? "position" : "CO, position",
              .width = 560.0,
              .height = 260.0};
  if (scan) {
    // Starts at the first reversal, because the way there belongs to no branch.
    chart.lines.push_back({"signature", palette::kBlue, r.co, r.position});
    chart.lines.push_back({"CO", palette::kGrey, r.co, r.co, true});
  } else {
    std::vector<double> t;
    for (const double time : r.time_s) t.push_back(time - r.time_s.front());
    chart.lines.push_back({"CO", palette::kGrey, t, r.co, true});
    chart.lines.push_back({"position", palette::kBlue, t, r.position});
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

// Returns the figure of the commissioning run, if it has one.
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
  if (options.background) work_in_background();
  if (!options.plan.empty()) {
    if (options.bench.live && !options.record.empty()) require("either --live or --record");
    return run_planned_test({.plan = options.plan,
                             .target = options.bench.target,
                             .socket = options.bench.socket,
                             .record = options.record,
                             .live = options.bench.live,
                             .out = options.out,
                             .survey = options.survey,
                             .json = options.json});
  }
  if (options.bench.target.empty()) require("valve-test: a model or tag, or --plan,");
  check_limits(options.bench);
  json commissioning = json::object();
  if (!options.commissioning.empty()) {
    std::ifstream file(options.commissioning);
    commissioning = json::parse(file, nullptr, false);
    if (!commissioning.is_object()) {
      fail(kExitData, "{}: is not a result of valve-test", options.commissioning);
    }
  }
  std::vector<TestResult> results;
  try {
    const std::unique_ptr<TestBench> bench = bench_of(options.bench);
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
    fail(kExitTryAgain, "{}: test ended: {}", options.bench.target, e.what());
  }
  const json result = as_json(results, options);
  if (!options.out.empty()) {
    const std::filesystem::path folder = options.out;
    OutputFiles files({options.commissioning, options.bench.live ? "" : options.bench.target});
    files.make_folder(folder);
    files.add(folder / "report.html", page(results, commissioning, options.bench.target));
    files.add(folder / "valve-test.json", result.dump(2) + "\n");
    files.commit();
  }
  options.json ? show_json(result) : print_text(results, commissioning);
  return kExitOk;
}

}  // namespace

void add_valve_test(Program& program) {
  auto [command, o] = program.command(
      "valve-test", "Run step, ramp, resolution, scan and sine tests of a valve, simulated or live",
      run_valve_test);
  command.option("target", o.bench.target,
                 "loop model, YAML; with --live the tag of a loop; default with --plan: that of "
                 "the plan");
  add_bench_options(command, o.bench);
  const Option plan = command.option(
      "--plan", o.plan, "next_test.yaml of `gap`: carry out this test and judge it, with --out");
  command
      .option(
          "--record", o.record,
          "with --plan: record of the loop after the plan, or folder of the recorder's segments: "
          "find the move that a person made, and judge it")
      .needs(plan);
  command
      .option("--survey", o.survey,
              "with --plan: folder of a survey, whose tests.csv and survey.json receive the result")
      .needs(plan);
  std::vector<std::string> names;
  for (const ValveTest test : analysis::kValveTests) names.emplace_back(analysis::to_text(test));
  command.option("--test", o.tests, "tests to run; default: all", one_of(names));
  command.option("--hold", o.hold_s, "duration at each point, s; default 20", above_zero());
  command.option("--gain", o.gain,
                 "PV units/CO unit, to derive the position from PV without a read-back");
  command.option("--commissioning", o.commissioning,
                 "valve-test.json of an earlier run, for comparison");
  command.option("--out", o.out, "folder for valve-test.json and report.html");
  command.flag("--json", o.json, "print the result as JSON");
  add_background(command, o.background);
  command.footer(
      "Live, it needs --low, --high, --pv-low and --pv-high, or --plan. At every end, also 60 s "
      "after kill -9,\nthe daemon restores output, mode and set point. Exit code 75: ended early, "
      "or the move of\n--plan is not in --record.\n"
      "Examples: loopwarden valve-test FIC-101 --live --low 3 --high 5 --pv-low 2 --pv-high 8 "
      "--out test\n"
      "          loopwarden valve-test FIC-101 --plan gap/next_test.yaml --live --out test");
}

}  // namespace loopwarden::workbench
