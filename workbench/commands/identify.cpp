// SPDX-License-Identifier: Apache-2.0
// loopwarden identify: process models from a step record.
#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "record/record_csv.hpp"
#include "model/analysis/identification.hpp"
#include "model/analysis/step_metrics.hpp"
#include "workbench/report/chart.hpp"
#include "workbench/files/output_files.hpp"
#include "workbench/command_line/progress.hpp"
#include "workbench/commands/subcommands.hpp"

namespace loopwarden::workbench {
namespace {

struct IdentifyOptions {
  std::string record;
  std::string out;  // picture
  bool json = false;
};

struct Findings {
  analysis::ProcessFit first, second;
  std::optional<analysis::Tangent> tangent;
  std::string no_tangent;
  std::optional<analysis::StepMetrics> metrics;
  bool second_is_better = false;
};

Findings look_at(const record::Record& record) {
  Findings f;
  f.first = analysis::identify(record.co, record.pv, record.period_s, 1);
  f.second = analysis::identify(record.co, record.pv, record.period_s, 2);
  f.second_is_better = f.second.criterion < f.first.criterion - 10.0;
  try {
    f.tangent = analysis::tangent_method(record.co, record.pv, record.period_s);
    const auto from = static_cast<std::size_t>(f.tangent->step_time_s / record.period_s + 0.5);
    f.metrics = analysis::step_metrics(std::span(record.pv).subspan(from), f.tangent->before,
                                       f.tangent->final_value, record.period_s);
  } catch (const analysis::IdentificationError& e) {
    f.no_tangent = e.what();
  }
  return f;
}

nlohmann::json as_json(const analysis::Estimate& e) {
  return {{"value", e.value}, {"interval", {e.value - e.margin, e.value + e.margin}}};
}

nlohmann::json as_json(const analysis::ProcessFit& fit) {
  nlohmann::json result = {{"gain", as_json(fit.gain)},
                           {"time_constant_s", as_json(fit.time_constant_s)},
                           {"dead_time_s", as_json(fit.dead_time_s)},
                           {"rest_pv", fit.rest_pv},
                           {"rmse", fit.rmse},
                           {"fit_percent", fit.fit_percent},
                           {"criterion", fit.criterion}};
  if (fit.order == 2) result["second_lag_s"] = as_json(fit.second_lag_s);
  return result;
}

nlohmann::json finite(double value) {
  return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json(nullptr);
}

void print_json(const Findings& f) {
  nlohmann::json result = {{"fopdt", as_json(f.first)},
                           {"sopdt", as_json(f.second)},
                           {"preferred", f.second_is_better ? "sopdt" : "fopdt"}};
  if (f.tangent) {
    result["tangent"] = {{"gain", f.tangent->process.gain},
                         {"time_constant_s", f.tangent->process.time_constant_s},
                         {"dead_time_s", f.tangent->process.dead_time_s},
                         {"slope", f.tangent->slope}};
    result["step"] = {{"delay_s", finite(f.metrics->delay_s)},
                      {"rise_10_90_s", finite(f.metrics->rise_10_90_s)},
                      {"peak_time_s", f.metrics->peak_time_s},
                      {"overshoot_percent", 100.0 * f.metrics->overshoot},
                      {"settling_2_percent_s", finite(f.metrics->settling_2_s)}};
  } else {
    result["tangent"] = nullptr;
  }
  fmt::print("{}\n", result.dump(2));
}

std::string with_margin(const analysis::Estimate& e) {
  return fmt::format("{:.5g} +-{:.2g}", e.value, e.margin);
}

void print_text(const Findings& f) {
  fmt::print("{:<28} {:>20} {:>20}\n", "", "one lag", "two lags");
  const auto row = [](const char* what, const std::string& one, const std::string& two) {
    fmt::print("{:<28} {:>20} {:>20}\n", what, one, two);
  };
  row("gain, PV units/CO unit", with_margin(f.first.gain), with_margin(f.second.gain));
  row("time constant, s", with_margin(f.first.time_constant_s),
      with_margin(f.second.time_constant_s));
  row("second lag, s", "-", with_margin(f.second.second_lag_s));
  row("dead time, s", with_margin(f.first.dead_time_s), with_margin(f.second.dead_time_s));
  row("left over (rms), PV units", fmt::format("{:.4g}", f.first.rmse),
      fmt::format("{:.4g}", f.second.rmse));
  row("fit, %", fmt::format("{:.2f}", f.first.fit_percent),
      fmt::format("{:.2f}", f.second.fit_percent));
  fmt::print("Intervals of 95 %. {}\n", f.second_is_better
                                            ? "Two lags describe the record better."
                                            : "A second lag does not describe the record better.");
  if (f.tangent) {
    fmt::print("Tangent: gain {:.4g}, time constant {:.4g} s, dead time {:.4g} s\n",
               f.tangent->process.gain, f.tangent->process.time_constant_s,
               f.tangent->process.dead_time_s);
    fmt::print(
        "Step: half after {:.4g} s, rise (10 to 90 %) {:.4g} s, overshoot {:.3g} %, within "
        "2 % after {:.4g} s\n",
        f.metrics->delay_s, f.metrics->rise_10_90_s, 100.0 * f.metrics->overshoot,
        f.metrics->settling_2_s);
  } else {
    fmt::print("No tangent: {}\n", f.no_tangent);
  }
  const analysis::ProcessFit& best = f.first;
  fmt::print(
      "For a model file:\nprocess:\n  gain: {:.5g}\n  time_constant: {:.5g}\n  dead_time: "
      "{:.5g}\n",
      best.gain.value, best.time_constant_s.value, best.dead_time_s.value);
}

std::string picture(const record::Record& record, const Findings& f) {
  const std::vector<double> t = time_axis(record.size(), record.period_s);
  Chart chart{.title = "Step record and model", .x_label = "s", .y_label = "PV", .lines = {}};
  chart.lines.push_back({"measured", palette::kGrey, t, record.pv});
  const auto model = [&](const analysis::ProcessFit& fit) {
    plant::Process process({.gain = fit.gain.value,
                            .time_constant_s = fit.time_constant_s.value,
                            .dead_time_s = fit.dead_time_s.value},
                           record.period_s);
    process.reset(0.0);
    std::vector<double> y{fit.rest_pv};
    for (std::size_t k = 0; k + 1 < record.size(); ++k) {
      y.push_back(fit.rest_pv + process.step(record.co[k] - record.co.front()));
    }
    return y;
  };
  chart.lines.push_back({"one lag", palette::kBlue, t, model(f.first)});
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
    const record::Record record = record::read_record(options.record);
    if (!record.has_co) {
      fmt::print(stderr, "{}: has no column co; a process can't be identified without it\n",
                 options.record);
      return kExitData;
    }
    say_if_long(options.record, record.size());
    const Findings f = look_at(record);
    if (!options.out.empty()) write_output(options.out, picture(record, f), {options.record});
    options.json ? print_json(f) : print_text(f);
  } catch (const analysis::IdentificationError& e) {
    fmt::print(stderr, "{}: {}\n", options.record, e.what());
    return kExitData;
  } catch (const record::RecordError& e) {
    fmt::print(stderr, "{}\n", e.what());
    return e.kind() == record::RecordError::Kind::data ? kExitData : kExitIo;
  }
  return kExitOk;
}

}  // namespace

void add_identify(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<IdentifyOptions>();
  CLI::App* sub =
      app.add_subcommand("identify", "process model from a step record, with intervals");
  sub->add_option("record", options->record, "record with co and pv, CSV, beginning at rest")
      ->required();
  sub->add_option("--out", options->out, "picture to write, SVG");
  sub->add_flag("--json", options->json, "print the result as JSON");
  sub->footer("Example: loopwarden identify step.csv --out step.svg");
  sub->callback([options, &exit_code] { exit_code = run_identify(*options); });
}

}  // namespace loopwarden::workbench
