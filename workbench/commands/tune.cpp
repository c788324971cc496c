// SPDX-License-Identifier: Apache-2.0
// loopwarden tune: controller settings for a loop model by named rules, with what each would do.
#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "model/analysis/loop_frequency.hpp"
#include "model/analysis/tuning_rules.hpp"
#include "workbench/command_line/frame.hpp"
#include "workbench/report/chart.hpp"
#include "workbench/files/model_file.hpp"
#include "model/analysis/loop_trial.hpp"
#include "workbench/files/output_files.hpp"
#include "workbench/commands/subcommands.hpp"

namespace loopwarden::workbench {
namespace {

// Robust in the sense of Åström and Hägglund (2006), section 4.6: 1.2 to 2.
constexpr double kMostSensitivity = 2.0;

struct TuneOptions {
  std::string model;
  std::string out;
  std::optional<double> lambda_s;
  bool pid = false;
  bool json = false;
};

struct RuleRow {
  std::string name;
  control::PidGains gains;
  bool scales = true;
  bool rule = true;  // not the model's own settings
  analysis::Margins margins{};
  analysis::PredictedResponse response{};
};

std::vector<RuleRow> rows_of(const plant::LoopModel& model, const TuneOptions& options) {
  std::vector<RuleRow> rows;
  // An integrating loop is slow by its rules: integral times of up to 13 dead times.
  const double half =
      (model.process.integrating()
           ? 100.0 * model.process.lags_and_dead_time_s()
           : 15.0 * (2.0 * (model.process.time_constant_s + model.process.second_time_constant_s) +
                     model.process.dead_time_s)) +
      10.0 * model.sample_time_s;
  const auto add = [&](std::string name, const control::PidGains& gains, bool scales, bool rule) {
    RuleRow row{.name = std::move(name), .gains = gains, .scales = scales, .rule = rule};
    analysis::LinearLoop linear = analysis::linear_loop(model);
    linear.gains = gains;
    row.margins = analysis::margins(linear);
    row.response = analysis::predict_response(model, gains, half);
    rows.push_back(std::move(row));
  };
  add("as it is", model.controller.pid.gains, true, false);
  for (const analysis::TuningRule rule : analysis::kTuningRules) {
    const std::optional<control::PidGains> gains = analysis::tune(
        rule, model.process,
        {.form = options.pid ? analysis::ControllerForm::pid : analysis::ControllerForm::pi,
         .lambda_s = options.lambda_s});
    if (gains) add(to_text(rule), *gains, analysis::scales_with_gain(rule), true);
  }
  return rows;
}

// Of the rules that scale with the gain and leave enough margin, the one that meets a load best.
const RuleRow* recommended(const std::vector<RuleRow>& rows) {
  const RuleRow* best = nullptr;
  for (const RuleRow& row : rows) {
    if (!row.rule || !row.scales || !row.margins.stable || !row.response.settles ||
        row.margins.sensitivity > kMostSensitivity) {
      continue;
    }
    if (best == nullptr || row.response.load_absolute_error < best->response.load_absolute_error) {
      best = &row;
    }
  }
  return best;
}

void print_json(const std::vector<RuleRow>& rows, const RuleRow* best) {
  nlohmann::json list = nlohmann::json::array();
  for (const RuleRow& r : rows) {
    list.push_back({{"rule", r.name},
                    {"kp", r.gains.kp},
                    {"ki", r.gains.ki},
                    {"kd", r.gains.kd},
                    {"scales_with_gain", r.scales},
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
      {"recommended", best != nullptr ? nlohmann::json(best->name) : nlohmann::json(nullptr)}};
  show_json(result);
}

std::string number(double value, const char* format) {
  return std::isfinite(value) ? fmt::format(fmt::runtime(format), value) : std::string("-");
}

std::vector<std::string> cells(const RuleRow& r) {
  return {r.name,
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
          : !r.scales       ? "leaves out the gain"
                            : ""};
}

const std::vector<std::string>& heads() {
  static const std::vector<std::string> names{"rule",        "kp",        "ki",       "kd",
                                              "gain margin", "phase deg", "Ms",       "rise s",
                                              "over %",      "settles s", "load IAE", ""};
  return names;
}

void print_text(const plant::LoopModel& model, const std::vector<RuleRow>& rows,
                const RuleRow* best) {
  fmt::print("process: {}\n\n", process_text(model.process));
  const auto line = [](const std::vector<std::string>& c) {
    fmt::print("{:<11} {:>8} {:>9} {:>7} {:>11} {:>9} {:>6} {:>7} {:>7} {:>9} {:>9}  {}\n", c[0],
               c[1], c[2], c[3], c[4], c[5], c[6], c[7], c[8], c[9], c[10], c[11]);
  };
  line(heads());
  for (const RuleRow& row : rows) line(cells(row));
  fmt::print(
      "\nrise, overshoot and settling (2 %) of a set-point step; load IAE: integral of |SP - PV| "
      "after a load step of 10 % of the range.\n");
  if (best != nullptr) {
    fmt::print(
        "Recommended: {} (least load IAE of the rules that scale with the gain, with Ms at most "
        "{:g})\n  kp: {:.5g}\n  ki: {:.5g}\n",
        best->name, kMostSensitivity, best->gains.kp, best->gains.ki);
    if (best->gains.kd > 0.0) {
      fmt::print("  kd: {:.5g}\n  derivative_filter: {:.4g}\n", best->gains.kd,
                 best->gains.derivative_filter_s);
    }
  } else {
    fmt::print("No rule leaves enough margin (Ms at most {:g}) on this process.\n",
               kMostSensitivity);
  }
}

std::string page(const std::string& model_file, const std::vector<RuleRow>& rows,
                 const RuleRow* best) {
  Chart pv{.title = "Set-point step, then a load step",
           .x_label = "s",
           .y_label = "PV",
           .width = 1100.0,
           .height = 360.0};
  Chart co = pv;
  co.title = "What the controller does";
  co.y_label = "CO";
  const analysis::LoopRecord& first = rows.front().response.record;
  const std::vector<double> t = time_axis(first.pv.size(), first.sample_time_s);
  pv.lines.push_back({"SP", palette::kGrey, t, first.sp, true});
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (!rows[i].margins.stable) continue;
    pv.lines.push_back({rows[i].name, chart_colour(i), t, rows[i].response.record.pv});
    co.lines.push_back({rows[i].name, chart_colour(i), t, rows[i].response.record.co});
  }
  std::string table = "<table><tr>";
  for (const std::string& head : heads()) table += "<th>" + head + "</th>";
  table += "</tr>\n";
  for (const RuleRow& row : rows) {
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
  const std::vector<RuleRow> rows = rows_of(model, options);
  const RuleRow* best = recommended(rows);
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
      "tune", "controller settings by named rules, and what each would do", run_tune);
  command.required("model", o.model, "loop model, YAML");
  command.option("--lambda", o.lambda_s, "s, closed-loop time constant of the lambda rule",
                 above_zero());
  command.flag("--pid", o.pid, "PID settings instead of PI, of the rules that have them");
  command.option("--out", o.out, "report with the predicted responses to write, HTML");
  command.flag("--json", o.json, "print the result as JSON");
  command.footer("Example: loopwarden tune config/examples/models/plant1.yaml --out tuning.html");
}

}  // namespace loopwarden::workbench
