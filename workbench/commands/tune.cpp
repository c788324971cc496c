// SPDX-License-Identifier: Apache-2.0
// loopwarden tune: computes controller settings for a loop model by named rules, with their
// predicted effects.
#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "model/analysis/rule_trial.hpp"
#include "model/analysis/limits.hpp"
#include "workbench/command_line/frame.hpp"
#include "workbench/report/chart.hpp"
#include "workbench/files/model_file.hpp"
#include "workbench/files/output_files.hpp"
#include "workbench/commands/subcommands.hpp"

namespace loopwarden::workbench {
namespace {

struct TuneOptions {
  std::string model;
  std::string out;
  std::optional<double> lambda_s;
  bool pid = false;
  bool json = false;
};

using analysis::RuleTrial;

void print_json(const std::vector<RuleTrial>& rows, const RuleTrial* best) {
  nlohmann::json list = nlohmann::json::array();
  for (const RuleTrial& r : rows) {
    list.push_back({{"rule", r.name()},
                    {"kp", r.gains.kp},
                    {"ki", r.gains.ki},
                    {"kd", r.gains.kd},
                    {"scales_with_gain", r.scales()},
                    {"stable", r.margins.stable},
                    {"gain_margin", r.margins.gain_margin},
                    {"phase_margin_deg", r.margins.phase_margin_deg},
                    {"delay_margin_s", r.margins.delay_margin_s},
                    {"sensitivity", r.margins.sensitivity},
                    {"rise_10_90_s", r.response.step.rise_10_90_s},
                    {"overshoot_percent", 100.0 * r.response.step.overshoot},
                    {"settling_2_percent_s", r.response.step.settling_2_s},
                    {"load_absolute_error", r.response.load_absolute_error}});
  }
  const nlohmann::json result = {
      {"rules", std::move(list)},
      {"recommended", best != nullptr ? nlohmann::json(best->name()) : nlohmann::json(nullptr)}};
  show_json(result);
}

std::string number(double value, const char* format) {
  return std::isfinite(value) ? fmt::format(fmt::runtime(format), value) : std::string("-");
}

std::vector<std::string> cells(const RuleTrial& r) {
  return {r.name(),
          number(r.gains.kp, "{:.4g}"),
          number(r.gains.ki, "{:.4g}"),
          number(r.gains.kd, "{:.3g}"),
          number(r.margins.gain_margin, "{:.2f}"),
          number(r.margins.phase_margin_deg, "{:.0f}"),
          number(r.margins.sensitivity, "{:.2f}"),
          number(r.response.step.rise_10_90_s, "{:.1f}"),
          number(100.0 * r.response.step.overshoot, "{:.0f}"),
          number(r.response.step.settling_2_s, "{:.1f}"),
          number(r.response.load_absolute_error, "{:.3g}"),
          !r.margins.stable ? "unstable"
          : !r.scales()     ? "ignores the gain"
                            : ""};
}

const std::vector<std::string>& rule_heads() {
  static const std::vector<std::string> names{"rule",        "kp",        "ki",        "kd",
                                              "gain margin", "phase deg", "Ms",        "rise s",
                                              "over %",      "settles s", "dist. IAE", ""};
  return names;
}

void print_recommended(const RuleTrial* best) {
  if (best == nullptr) {
    fmt::print("No rule has enough margin (Ms at most {:g}) on this process.\n",
               analysis::AnalysisLimits::kMostSensitivity);
    return;
  }
  fmt::print(
      "Recommended: {} (lowest disturbance IAE of the rules that scale with the gain, with Ms at "
      "most {:g})\n  kp: {:.5g}\n  ki: {:.5g}\n",
      best->name(), analysis::AnalysisLimits::kMostSensitivity, best->gains.kp, best->gains.ki);
  if (best->gains.kd > 0.0) {
    fmt::print("  kd: {:.5g}\n  derivative_filter: {:.4g}\n", best->gains.kd,
               best->gains.derivative_filter_s);
  }
}

void print_text(const plant::LoopModel& model, const std::vector<RuleTrial>& rows,
                const RuleTrial* best) {
  fmt::print("process: {}\n", process_text(model.process));
  print_recommended(best);
  const auto line = [](const std::vector<std::string>& c) {
    fmt::print("{:<11} {:>8} {:>9} {:>7} {:>11} {:>9} {:>6} {:>7} {:>7} {:>9} {:>9}  {}\n", c[0],
               c[1], c[2], c[3], c[4], c[5], c[6], c[7], c[8], c[9], c[10], c[11]);
  };
  fmt::print("\n");
  line(rule_heads());
  for (const RuleTrial& row : rows) line(cells(row));
  fmt::print(
      "\nrise, overshoot and settling (2 %) of a set-point step; disturbance IAE: integral of |SP "
      "- PV| after a disturbance step of 10 % of the range.\n");
}

std::string page(const std::string& model_file, const std::vector<RuleTrial>& rows,
                 const RuleTrial* best) {
  Chart pv{.title = "Set-point step, then a disturbance step",
           .x_label = "s",
           .y_label = "PV",
           .width = 1100.0,
           .height = 360.0};
  Chart co = pv;
  co.title = "Controller output";
  co.y_label = "CO";
  const analysis::SimulatedRecord& first = rows.front().response.record;
  const std::vector<double> t = time_axis(first.pv.size(), first.period_s);
  pv.lines.push_back({"SP", palette::kGrey, t, first.sp, true});
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (!rows[i].margins.stable) continue;
    pv.lines.push_back({rows[i].name(), chart_colour(i), t, rows[i].response.record.pv});
    co.lines.push_back({rows[i].name(), chart_colour(i), t, rows[i].response.record.co});
  }
  std::string table = "<table><tr>";
  for (const std::string& head : rule_heads()) table += "<th>" + head + "</th>";
  table += "</tr>\n";
  for (const RuleTrial& row : rows) {
    table += "<tr>";
    for (const std::string& cell : cells(row)) {
      table += fmt::format("<td{}>{}</td>", &row == best ? " class=\"best\"" : "", escaped(cell));
    }
    table += "</tr>\n";
  }
  return html_page(
      "Tuning of " + model_file,
      table +
          "</table>\n<p class=\"note\">Bold: recommended. Unstable settings are not drawn.</p>\n" +
          chart_svg(pv) + chart_svg(co));
}

int run_tune(const TuneOptions& options) {
  const plant::LoopModel model = load_model(options.model);
  const std::vector<RuleTrial> rows = analysis::try_rules(
      model, {.form = options.pid ? analysis::ControllerForm::pid : analysis::ControllerForm::pi,
              .lambda_s = options.lambda_s});
  const RuleTrial* best = analysis::recommended(rows);
  if (!options.out.empty()) {
    write_output(options.out,
                 page(std::filesystem::path(options.model).filename().string(), rows, best),
                 {options.model});
  }
  options.json ? print_json(rows, best) : print_text(model, rows, best);
  return kExitOk;
}

}  // namespace

void add_tune(Program& program) {
  auto [command, o] = program.command(
      "tune", "Compute controller settings by named rules, with their predicted effects", run_tune);
  command.required("model", o.model, "loop model, YAML");
  command.option("--lambda", o.lambda_s, "closed-loop time constant of the lambda rule, s",
                 above_zero());
  command.flag("--pid", o.pid, "PID settings instead of PI, for rules that have them");
  command.option("--out", o.out, "report with the predicted responses to write, HTML");
  command.flag("--json", o.json, "print the result as JSON");
  command.footer("Example: loopwarden tune examples/models/plant1.yaml --out tuning.html");
}

}  // namespace loopwarden::workbench
