// SPDX-License-Identifier: Apache-2.0
// loopwarden-study gallery: draws closed-loop trends, CO-PV correlation and signatures of plant 1
// for each fault of the thesis's chapter 7. It adds the measures that the statements of the thesis
// refer to, and draws measured loops.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "model/analysis/loop_metrics.hpp"
#include "model/plant/plant.hpp"
#include "workbench/report/chart.hpp"
#include "workbench/command_line/command_line.hpp"
#include "workbench/report/effect_picture.hpp"
#include "workbench/text/json_number.hpp"
#include "model/analysis/loop_trial.hpp"
#include "workbench/files/output_files.hpp"
#include "lab/gallery/measured_loops.hpp"
#include "lab/program/studies.hpp"

namespace loopwarden::lab {
namespace {

constexpr double kWindow = 96.1;     // s, 961 samples
constexpr double kDuration = 900.0;  // s

struct Exhibit {
  const char* file;
  const char* title;
  std::vector<effects::EffectSpec> effects;
};

effects::EffectSpec effect_of(const char* name, std::map<std::string, double> parameters) {
  return {.name = name, .parameters = std::move(parameters)};
}

std::vector<Exhibit> exhibits() {
  return {
      {"no-fault", "no fault", {}},
      {"backlash-0.5", "backlash 0.5 V", {effect_of("backlash", {{"deadband", 0.5}})}},
      {"backlash-1.5", "backlash 1.5 V", {effect_of("backlash", {{"deadband", 1.5}})}},
      {"stiction-weak",
       "stiction, S 0.5 V, J 0.2 V",
       {effect_of("stiction", {{"s", 0.5}, {"j", 0.2}})}},
      {"stiction-strong",
       "stiction, S 1.5 V, J 0.6 V",
       {effect_of("stiction", {{"s", 1.5}, {"j", 0.6}})}},
      {"cam-small",
       "cam obstruction, band 0.3 V, jump 0.2 V",
       {effect_of("cam_obstruction", {{"position", 3.98}, {"band", 0.3}, {"jump", 0.2}})}},
      {"cam-large",
       "cam obstruction, band 0.9 V, jump 0.6 V",
       {effect_of("cam_obstruction", {{"position", 3.78}, {"band", 0.9}, {"jump", 0.6}})}},
      {"low-air",
       "low air supply, 0.3 V/s, to 5 V",
       {effect_of("low_air_supply", {{"rate", 0.3}, {"travel_limit", 5.0}})}},
      {"lower-air",
       "lower air supply, 0.06 V/s, to 3.8 V",
       {effect_of("low_air_supply", {{"rate", 0.06}, {"travel_limit", 3.8}})}},
      {"hysteresis-offset",
       "hysteresis, offset 0.7 V",
       {effect_of("hysteresis", {{"offset", 0.7}})}},
      {"hysteresis-width", "hysteresis, width 1 V", {effect_of("hysteresis", {{"width", 1.0}})}},
  };
}

// Plant 1, 0 to 5 L/min as in the thesis's trends, with its noise.
plant::LoopModel model_of(const Exhibit& exhibit) {
  plant::LoopModel model = workbench::effect_example_model();
  model.controller.pid.anti_windup = control::AntiWindup::back_calculation;
  model.controller.output.high = 10.0;
  model.controller.set_point.high = 10.0;
  model.transmitter = {.low = 0.0, .high = 10.0, .resolution = 10.0 / 4096.0, .noise = 0.01};
  model.valve_effects = exhibit.effects;
  model.scenario.set_point = {{0.0, 0.0}, {1.0, 5.0}};
  return model;
}

struct Figures {
  double dead_time_s = 0.0;  // time until PV has moved by 2 % of the step
  double reach_s = 0.0;      // time until PV first reaches 95 % of the set point
  double offset = 0.0;       // mean SP - PV of the last window, L/min
  double pv_swing = 0.0;     // of the last 600 s, L/min
  double co_swing = 0.0;     // V
  double period_s = 0.0;
};

Figures figures_of(const analysis::SimulatedRecord& r) {
  Figures f;
  const double h = r.period_s;
  const auto first = [&](double level) {
    for (std::size_t k = 0; k < r.true_pv.size(); ++k) {
      if (r.true_pv[k] >= level) return static_cast<double>(k) * h - 1.0;
    }
    return std::nan("");
  };
  f.dead_time_s = first(0.02 * 5.0);
  f.reach_s = first(0.95 * 5.0);
  const auto tail = [&](const std::vector<double>& column, double seconds) {
    return std::vector<double>(column.end() - static_cast<std::ptrdiff_t>(seconds / h),
                               column.end());
  };
  const std::vector<double> pv = tail(r.true_pv, 600.0);
  const std::vector<double> co = tail(r.co, 600.0);
  const analysis::LoopMetrics m = analysis::loop_metrics(tail(r.sp, 600.0), pv, {}, h, 0.0);
  f.offset = m.mean_error;
  f.pv_swing = *std::max_element(pv.begin(), pv.end()) - *std::min_element(pv.begin(), pv.end());
  f.co_swing = *std::max_element(co.begin(), co.end()) - *std::min_element(co.begin(), co.end());
  f.period_s = f.pv_swing > 0.1 ? m.period_s : 0.0;
  return f;
}

std::string picture(const Exhibit& exhibit, const analysis::SimulatedRecord& r) {
  const auto cut = [&](const std::vector<double>& column, double from_s, double to_s) {
    const auto at = [&](double s) {
      return column.begin() + static_cast<std::ptrdiff_t>(s / r.period_s);
    };
    return std::vector<double>(at(from_s), at(to_s));
  };
  const auto trend = [&](double to_s) {
    const std::vector<double> t = workbench::time_axis(cut(r.pv, 0.0, to_s).size(), r.period_s);
    workbench::Chart chart{.title = "closed loop",
                           .x_label = "s",
                           .y_label = "L/min, V",
                           .width = 460.0,
                           .height = 240.0};
    chart.lines = {{"SP", workbench::palette::kGrey, t, cut(r.sp, 0.0, to_s), true},
                   {"PV", workbench::palette::kBlue, t, cut(r.pv, 0.0, to_s)},
                   {"CO", workbench::palette::kVermilion, t, cut(r.co, 0.0, to_s)}};
    return chart;
  };
  workbench::Chart signature = trend(kWindow);
  signature.title = "signature: the first 961 samples";
  workbench::Chart correlation{.title = "correlation of PV and CO",
                               .x_label = "CO, V",
                               .y_label = "PV, L/min",
                               .width = 300.0,
                               .height = 240.0};
  correlation.lines = {
      {"", workbench::palette::kBlue, cut(r.co, 0.0, 600.0), cut(r.true_pv, 0.0, 600.0)}};
  std::vector<workbench::Chart> charts{std::move(signature), trend(600.0)};
  correlation.width = 460.0;
  charts.push_back(std::move(correlation));
  return workbench::chart_sheet(exhibit.title, charts, 3);
}

// Figure 7.17: CO from 2 to 4 V and back, with 0.7 V added while it falls. Returns the steps of PV
// up and down.
std::pair<double, double> open_loop_steps(const std::vector<effects::EffectSpec>& after) {
  plant::LoopModel model = model_of({"", "", {effect_of("hysteresis", {{"offset", 0.7}})}});
  model.transmitter.noise = 0.0;
  model.transmitter.resolution = 0.0;
  for (const effects::EffectSpec& spec : after) model.valve_effects.push_back(spec);
  plant::Plant plant(model, 1);
  plant.reset(1.0);
  const auto rest = [&](double co) {
    for (int k = 0; k < 600; ++k) plant.step(co);
    return plant.process_variable();
  };
  const double low = rest(2.0);
  const double high = rest(4.0);
  return {high - low, rest(2.0) - high};
}

std::string markdown(const std::vector<MeasuredLoop>& measured) {
  std::string text =
      "# Gallery of faults\n\n"
      "<!-- Generated: `loopwarden-study gallery --out docs/reference` renews it and its pictures. "
      "-->\n\n"
      "This page shows how each valve fault looks in a record: [simulated](#plant-1) records with "
      "one fault each, and [measured](#measured-loops) records.\n"
      "The mechanism of each fault and its remedy are in "
      "[valve faults](../explanation/valve-faults.md).\n\n"
      "## Plant 1\n\n"
      "The set point steps from 0 to 5 L/min at 1 s. Each fault has two sizes.\n"
      "Each picture has three parts: the first 961 samples, which specialists judge; 600 s; PV "
      "over CO.\n"
      "Plant 1 of the thesis has gain 1.2264, time constant 1.694 s and dead time 2.626 s.\n"
      "Its controller is a PI with kp 0.3494 and ki 0.04 1/s. The noise is 0.01 L/min.\n"
      "[The thesis](../project/thesis.md) has the statement for each measure.\n\n"
      "| fault | dead time, s | 95 % after, s | offset, L/min | PV swing | CO swing | period, s |\n"
      "|---|---|---|---|---|---|---|\n";
  std::string pictures;
  for (const Exhibit& exhibit : exhibits()) {
    const Figures f = figures_of(analysis::run_model(model_of(exhibit), kDuration));
    text += fmt::format(
        "| {} | {:.1f} | {} | {:.3f} | {:.3f} | {:.3f} | {} |\n", exhibit.title, f.dead_time_s,
        std::isfinite(f.reach_s) ? fmt::format("{:.1f}", f.reach_s) : "never", f.offset, f.pv_swing,
        f.co_swing, f.period_s > 0.0 ? fmt::format("{:.1f}", f.period_s) : "-");
    pictures +=
        fmt::format("\n### {0}\n\n![{0}](pictures/gallery/{1}.svg)\n", exhibit.title, exhibit.file);
  }
  text +=
      "\n- Dead time: until PV has moved by 2 % of the step.\n"
      "- Offset: mean SP - PV of the last 600 s of 900 s.\n"
      "- Swings (greatest minus least value) and period: from the same time.\n\n"
      "Figure 7.17 of the thesis is an open loop: CO goes from 2 V to 4 V and back, with 0.7 V "
      "added while it falls.\n\n"
      "| valve | PV up, L/min | PV down | down/up |\n|---|---|---|---|\n";
  effects::EffectSpec quick = effect_of("valve_characteristic", {});
  quick.options = {{"curve", "quick_opening"}};
  effects::EffectSpec butterfly = effect_of("valve_characteristic", {});
  butterfly.options = {{"curve", "butterfly"}};
  effects::EffectSpec table = effect_of("valve_characteristic", {});
  table.options = {{"curve", "table"}};
  // 0.55 and 0.30 L/min over gain 1.2264 between 2, 2.7 and 4 V.
  table.table = {
      {0.0, 0.0}, {2.0, 1.6}, {2.7, 1.6 + 0.55 / 1.2264}, {4.0, 1.6 + 0.85 / 1.2264}, {10.0, 10.0}};
  const std::vector<std::pair<const char*, std::vector<effects::EffectSpec>>> valves{
      {"linear, as plant 1's model", {}},
      {"quick opening", {quick}},
      {"butterfly", {butterfly}},
      {"table with 0.55 L/min from 2 to 2.7 V and 0.30 from 2.7 to 4 V", {table}}};
  for (const auto& [name, effects] : valves) {
    const auto [up, down] = open_loop_steps(effects);
    text += fmt::format("| {} | {:.3f} | {:.3f} | {:.3f} |\n", name, up, down, -down / up);
  }
  text += "| thesis | 0.85 | -0.3 | 0.353 |\n";
  text += pictures;
  text +=
      "\n## Measured loops\n\n"
      "These are parts of open records ([examples](../../examples/README.md)). An engineer wrote "
      "each observation (Seen).\n"
      "The verdict of `loopwarden diagnose` is for the whole record, without other records and "
      "without the type of the loop.\n";
  for (const MeasuredLoop& loop : measured) {
    text += fmt::format(
        "\n### {0}\n\n![{0}](pictures/gallery/{1}.svg)\n\nSeen: {2}\n\n`diagnose`: {3}\n",
        loop.title, loop.file, loop.seen, loop.said);
  }
  return text;
}

nlohmann::json figures_json(const std::vector<MeasuredLoop>& measured) {
  nlohmann::json exhibits_json = nlohmann::json::array();
  for (const Exhibit& exhibit : exhibits()) {
    const Figures f = figures_of(analysis::run_model(model_of(exhibit), kDuration));
    exhibits_json.push_back({{"fault", exhibit.title},
                             {"dead_time_s", f.dead_time_s},
                             {"reach_s", workbench::finite_or_null(f.reach_s)},
                             {"offset", f.offset},
                             {"pv_swing", f.pv_swing},
                             {"co_swing", f.co_swing},
                             {"period_s", f.period_s}});
  }
  nlohmann::json measured_json = nlohmann::json::array();
  for (const MeasuredLoop& loop : measured) {
    measured_json.push_back({{"loop", loop.title}, {"seen", loop.seen}, {"diagnose", loop.said}});
  }
  return {{"plant1", std::move(exhibits_json)}, {"measured", std::move(measured_json)}};
}

// Returns the path of `loopwarden` of the same build.
std::string program_beside() {
  return (std::filesystem::read_symlink("/proc/self/exe").parent_path() / "loopwarden").string();
}

struct GalleryOptions {
  std::string out;
  std::string data = "examples";
  std::string program = program_beside();
  bool json = false;
};

int run_gallery(const GalleryOptions& options) {
  const std::vector<MeasuredLoop> measured = measured_loops(options.data, options.program);
  if (!options.out.empty()) {
    const std::filesystem::path folder = options.out;
    workbench::OutputFiles files;
    files.make_folder(folder / "pictures/gallery");
    for (const Exhibit& exhibit : exhibits()) {
      files.add(folder / "pictures/gallery" / (std::string(exhibit.file) + ".svg"),
                picture(exhibit, analysis::run_model(model_of(exhibit), kDuration)));
    }
    for (const MeasuredLoop& loop : measured) {
      files.add(folder / "pictures/gallery" / (loop.file + ".svg"), loop.picture);
    }
    files.add(folder / "gallery.md", markdown(measured));
    files.commit();
  }
  if (options.json) {
    fmt::print("{}\n", figures_json(measured).dump(2));
  } else if (options.out.empty()) {
    fmt::print("{}", markdown(measured));
  }
  return kExitOk;
}

}  // namespace

void add_gallery(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<GalleryOptions>();
  CLI::App* sub = app.add_subcommand(
      "gallery",
      "Draw trend, CO-PV correlation and signature of plant 1 for each fault, and measured loops");
  sub->add_option("--out", options->out,
                  "folder for gallery.md and its pictures; without it the table");
  sub->add_option("--data", options->data, "folder with the records of measured loops")
      ->capture_default_str();
  sub->add_option("--program", options->program,
                  "path of loopwarden; default: in the folder of this program");
  workbench::add_json_flag(*sub, options->json);
  sub->footer("Example: loopwarden-study gallery --out docs/reference");
  sub->callback([options, &exit_code] { exit_code = run_gallery(*options); });
}

}  // namespace loopwarden::lab
