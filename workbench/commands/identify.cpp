// SPDX-License-Identifier: Apache-2.0
// loopwarden identify: identifies process models from a record, in open or in closed loop.
#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "record/record_csv.hpp"
#include "workbench/command_line/frame.hpp"
#include "workbench/records/record_input.hpp"
#include "model/analysis/identification.hpp"
#include "model/analysis/step_metrics.hpp"
#include "workbench/report/chart.hpp"
#include "workbench/files/output_files.hpp"
#include "workbench/command_line/progress.hpp"
#include "workbench/commands/subcommands.hpp"
#include "workbench/text/json_number.hpp"

namespace loopwarden::workbench {
namespace {

// A long record takes minutes and is mostly uninformative.
constexpr std::size_t kLongestIdentified = 50000;  // samples

struct IdentifyOptions {
  RecordInput input;
  std::string record;
  std::string out;  // picture
  bool json = false;
};

struct IdentifyFindings {
  analysis::Identification process;
  std::optional<analysis::Tangent> tangent;
  std::optional<analysis::StepMetrics> metrics;
};

IdentifyFindings look_at(const record::Record& record) {
  IdentifyFindings f;
  f.process = analysis::identify(record.view());
  if (f.process.closed_loop) return f;
  try {
    f.tangent = analysis::tangent_method(record.co, record.pv, record.period_s);
    const auto from = static_cast<std::size_t>(f.tangent->step_time_s / record.period_s + 0.5);
    f.metrics = analysis::step_metrics(std::span(record.pv).subspan(from), f.tangent->before,
                                       f.tangent->final_value, record.period_s);
  } catch (const analysis::IdentificationError&) {  // no single step of CO
    f.tangent.reset();
  }
  return f;
}

nlohmann::json as_json(const analysis::Estimate& e) {
  return {{"value", finite_or_null(e.value)},
          {"interval", {finite_or_null(e.low), finite_or_null(e.high)}}};
}

nlohmann::json as_json(const analysis::ProcessFit& fit) {
  nlohmann::json result = {
      {"gain", as_json(fit.gain)},      {"dead_time_s", as_json(fit.dead_time_s)},
      {"rest_pv", fit.rest_pv},         {"rmse", fit.rmse},
      {"fit_percent", fit.fit_percent}, {"prediction_rms", fit.prediction_rms},
      {"noise_order", fit.noise_order}, {"criterion", fit.criterion}};
  if (!analysis::is_integrating(fit.form)) {
    result["time_constant_s"] = as_json(fit.time_constant_s);
  }
  if (fit.second_lag_s.value > 0.0) result["second_lag_s"] = as_json(fit.second_lag_s);
  return result;
}

const char* form_key(analysis::ProcessForm form) {
  switch (form) {
    case analysis::ProcessForm::one_lag: return "fopdt";
    case analysis::ProcessForm::two_lags: return "sopdt";
    case analysis::ProcessForm::integrating: return "integrating";
    case analysis::ProcessForm::integrating_lag: break;
  }
  return "integrating_lag";
}

nlohmann::json as_json(const IdentifyFindings& f, const record::Record& record) {
  const analysis::Identification& p = f.process;
  nlohmann::json result = {{"verdict", p.can_tell() ? "identified" : "cant_tell"},
                           {"loop", p.closed_loop ? "closed" : "open"},
                           {"notes", p.notes}};
  if (p.used.count > 0) {
    result["used"] = {{"from_s", record.time_s[p.used.from]},
                      {"samples", p.used.count},
                      {"thinned", p.used.thinned}};
  }
  if (p.cycle) result["valve"] = {{"s", as_json(p.cycle->s)}, {"j", as_json(p.cycle->j)}};
  if (!p.can_tell()) {
    result["reason"] = p.reason;
    result["settle"] = p.settle;
    result["preferred"] = nullptr;
    return result;
  }
  for (const analysis::ProcessFit& fit : p.fits) result[form_key(fit.form)] = as_json(fit);
  result["preferred"] = form_key(p.best().form);
  result["tangent"] = nullptr;
  if (f.tangent) {
    result["tangent"] = {{"gain", f.tangent->process.gain},
                         {"time_constant_s", f.tangent->process.time_constant_s},
                         {"dead_time_s", f.tangent->process.dead_time_s},
                         {"slope", f.tangent->slope}};
    result["step"] = {{"delay_s", finite_or_null(f.metrics->delay_s)},
                      {"rise_10_90_s", finite_or_null(f.metrics->rise_10_90_s)},
                      {"peak_time_s", f.metrics->peak_time_s},
                      {"overshoot_percent", 100.0 * f.metrics->overshoot},
                      {"settling_2_percent_s", finite_or_null(f.metrics->settling_2_s)}};
  }
  return result;
}

std::string with_interval(const analysis::Estimate& e) {
  const std::string to =
      std::isfinite(e.high) ? fmt::format("to {:.4g}", e.high) : std::string("upwards");
  return fmt::format("{:.5g}   ({:.4g} {})", e.value, e.low, to);
}

void print_row(const char* what, const std::string& value) {
  fmt::print("  {:<32}{}\n", what, value);
}

void print_form(const analysis::ProcessFit& fit) {
  const bool integrating = analysis::is_integrating(fit.form);
  print_row(integrating ? "gain, PV units/(CO unit s)" : "gain, PV units/CO unit",
            with_interval(fit.gain));
  if (!integrating) print_row("time constant, s", with_interval(fit.time_constant_s));
  if (fit.second_lag_s.value > 0.0) print_row("second lag, s", with_interval(fit.second_lag_s));
  print_row("dead time, s", with_interval(fit.dead_time_s));
}

void print_found(const IdentifyFindings& f) {
  const analysis::Identification& p = f.process;
  const analysis::ProcessFit& best = p.best();
  fmt::print("Process: {}. In brackets: intervals of 95 %.\n", to_text(best.form));
  print_form(best);
  if (p.cycle) {
    fmt::print("Valve: sticks.\n");
    print_row("s, CO units", with_interval(p.cycle->s));
    print_row("j, CO units", with_interval(p.cycle->j));
  }
  fmt::print("Fit: {} {} {:.1f} % of PV. Remaining error: {:.4g} PV units (RMS).\n",
             p.cycle && p.fits.size() == 1 ? "valve and process" : "the process",
             p.cycle && p.fits.size() == 1 ? "explain" : "explains", best.fit_percent, best.rmse);
  if (f.tangent) {
    fmt::print("Tangent: gain {:.4g}, time constant {:.4g} s, dead time {:.4g} s\n",
               f.tangent->process.gain, f.tangent->process.time_constant_s,
               f.tangent->process.dead_time_s);
    fmt::print(
        "Step: half after {:.4g} s, rise (10 to 90 %) {:.4g} s, overshoot {:.3g} %, within 2 % "
        "after {:.4g} s\n",
        f.metrics->delay_s, f.metrics->rise_10_90_s, 100.0 * f.metrics->overshoot,
        f.metrics->settling_2_s);
  }
  fmt::print("For a model file:\nprocess:\n");
  const plant::ProcessParameters process = best.process();
  if (process.integrating()) fmt::print("  kind: integrating\n");
  fmt::print("  gain: {:.5g}\n", process.gain);
  if (process.level) fmt::print("  level: {:.5g}\n", *process.level);
  if (!process.integrating()) fmt::print("  time_constant: {:.5g}\n", process.time_constant_s);
  if (process.second_time_constant_s > 0.0) {
    fmt::print("  second_time_constant: {:.5g}\n", process.second_time_constant_s);
  }
  fmt::print("  dead_time: {:.5g}\n", process.dead_time_s);
}

void print_text(const IdentifyFindings& f) {
  const analysis::Identification& p = f.process;
  fmt::print("Loop: {}{}.\n", p.closed_loop ? "closed" : "open",
             p.by_mode       ? " (column mode)"
             : p.closed_loop ? " (CO follows from PV)"
                             : "");
  for (const std::string& note : p.notes) fmt::print("record: {}\n", note);
  if (p.can_tell()) {
    print_found(f);
  } else {
    fmt::print("Can't tell. {}\n{}\n", p.reason, p.settle);
  }
}

std::string picture(const record::Record& record, const IdentifyFindings& f) {
  const std::vector<double> t = time_axis(record.size(), record.period_s);
  Chart chart{
      .title = "Record and model",
      .x_label = "s",
      .y_label = "PV",
  };
  chart.lines.push_back({"measured", palette::kGrey, t, record.pv});
  const analysis::SamplesUsed& used = f.process.used;
  if (f.process.can_tell()) {
    const analysis::ProcessFit& best = f.process.best();
    std::vector<double> times;
    for (std::size_t k = 0; k < used.count; ++k) {
      times.push_back(static_cast<double>(used.from + k * used.thinned) * record.period_s);
    }
    chart.lines.push_back({to_text(best.form), palette::kBlue, times, best.free_run});
  }
  if (f.tangent) {
    const double from = f.tangent->step_time_s + f.tangent->process.dead_time_s;
    const double to = from + f.tangent->process.time_constant_s;
    chart.lines.push_back({"tangent",
                           palette::kVermilion,
                           {from, to},
                           {f.tangent->before, f.tangent->final_value},
                           true});
  }
  return chart_svg(chart);
}

int run_identify(const IdentifyOptions& options) {
  try {
    record::Record record = options.input.read(options.record).record;
    if (record.co.empty()) {
      fail(kExitData, "{}: has no column co; a process can't be identified without it",
           options.record);
    }
    keep_telling_part(record, kLongestIdentified, options.record);
    say_if_long(options.record, record.size());
    const IdentifyFindings f = look_at(record);
    if (!options.out.empty()) write_output(options.out, picture(record, f), {options.record});
    options.json ? show_json(as_json(f, record)) : print_text(f);
    if (!f.process.can_tell()) return kExitData;
  } catch (const analysis::IdentificationError& e) {
    fail(kExitData, "{}: {}", options.record, e.what());
  }
  return kExitOk;
}

}  // namespace

void add_identify(Program& program) {
  auto [command, o] = program.command(
      "identify", "Identify a process model from a record, in open or closed loop, with intervals",
      run_identify);
  command.required("record", o.record, "record with co and pv, CSV; in closed loop also sp");
  command.option("--out", o.out, "picture to write, SVG");
  command.flag("--json", o.json, "print the result as JSON");
  o.input.add_options(command);
  command.footer(
      "If a result can't be determined, the reason and a remedy are printed instead, and the "
      "exit code is 65.\n"
      "Example: loopwarden identify step.csv --out step.svg");
}

}  // namespace loopwarden::workbench
