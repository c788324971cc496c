// SPDX-License-Identifier: Apache-2.0
// loopwarden-study calm: prints the tables of calm_study.hpp as text or JSON.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "model/analysis/loop_trial.hpp"
#include "lab/calm_study/calm_study.hpp"
#include "lab/program/studies.hpp"
#include "workbench/command_line/progress.hpp"
#include "workbench/files/output_files.hpp"
#include "workbench/report/chart.hpp"

namespace loopwarden::lab {
namespace {

struct CalmOptions {
  std::size_t cases = 100;
  std::uint64_t seed = 1;
  std::string only;
  unsigned threads = std::max(1U, std::thread::hardware_concurrency());
  std::string picture;
  bool troubles = false;
  bool rate_limits = false;
  bool friction = false;
  bool json = false;
};

const char* name_of(Load load) { return load == Load::steady ? "steady" : "wandering"; }

void print_sticky(const StickyStudy& study) {
  fmt::print("\n{} load\n{:<42} {:>6} {:>6} | {:>6} {:>6} {:>6} {:>6} | {:>6} | {:>6} {:>6}\n",
             name_of(study.load), "", "falls", "rises", "RMS", "", "", "", "whole", "travel",
             "above");
  fmt::print("{:<42} {:>6} {:>6} | {:>6} {:>6} {:>6} {:>6} | {:>6} | {:>6} {:>6}\n", "", "%",
             "5 %, %", "10 %", "median", "90 %", "worst", "median", "median", "1, %");
  for (const StickyRow& row : study.rows) {
    fmt::print(
        "{:<42} {:>6.1f} {:>6.1f} | {:>6.3f} {:>6.3f} {:>6.3f} {:>6.2f} | {:>6.3f} | {:>6.2f} "
        "{:>6.1f}\n",
        row.name, 100.0 * row.share_falls, 100.0 * row.share_rises_5, row.rms_factor.tenth,
        row.rms_factor.median, row.rms_factor.ninetieth, row.rms_factor.worst, row.whole_rms_factor,
        row.travel_factor, 100.0 * row.share_travel);
    if (row.share_offered < 1.0) {
      fmt::print("  of the {:.1f} % that it is offered; the others stay under PI\n",
                 100.0 * row.share_offered);
    }
  }
}

nlohmann::json json_of(const StickyStudy& study) {
  nlohmann::json rows = nlohmann::json::array();
  for (const StickyRow& row : study.rows) {
    rows.push_back({{"name", row.name},
                    {"share_falls", row.share_falls},
                    {"share_rises_5", row.share_rises_5},
                    {"rms_factor",
                     {{"tenth", row.rms_factor.tenth},
                      {"median", row.rms_factor.median},
                      {"ninetieth", row.rms_factor.ninetieth},
                      {"worst", row.rms_factor.worst}}},
                    {"whole_rms_factor", row.whole_rms_factor},
                    {"travel_factor", row.travel_factor},
                    {"share_travel", row.share_travel},
                    {"share_offered", row.share_offered},
                    {"factors", row.factors}});
  }
  return {{"load", name_of(study.load)}, {"rows", rows}};
}

// Draws the last of three hours of one loop: plant 1 with a wandering load and a sticking valve.
std::string hour_of_a_loop() {
  plant::LoopModel model;
  model.controller.pid = {.gains = {.kp = 0.25, .ki = 0.06}, .output_high = 10.0};
  model.controller.output.high = 10.0;
  model.controller.set_point.high = 10.0;
  model.process = {.gain = 1.2264, .time_constant_s = 1.69376, .dead_time_s = 2.6256};
  model.transmitter = {.high = 10.0, .noise = 0.01};
  model.valve_effects = {{.name = "stiction",
                          .parameters = {{"s", 0.8}, {"j", 0.4}},
                          .options = {{"law", "karnopp"}}}};
  model.disturbances = {
      {.name = "random_load", .parameters = {{"intensity", 0.006}, {"time_constant", 300.0}}}};
  model.scenario.set_point = {{0.0, 5.0}, {9000.0, 5.5}};
  model.scenario.seed = 2;
  std::vector<workbench::Chart> charts;
  const auto add = [&](const char* name,
                       const std::function<void(control::ControllerSettings&)>& fit) {
    plant::LoopModel with = model;
    fit(with.controller);
    const analysis::SimulatedRecord r = analysis::run_model(with, 10800.0);
    const std::size_t from = static_cast<std::size_t>(7200.0 / model.sample_time_s);
    const auto cut = [&](const std::vector<double>& column) {
      return std::vector<double>(column.begin() + static_cast<std::ptrdiff_t>(from), column.end());
    };
    std::vector<double> minutes = workbench::time_axis(r.sp.size() - from, model.sample_time_s);
    for (double& time : minutes) time /= 60.0;
    workbench::Chart pv{
        .title = name, .x_label = "min", .y_label = "PV, SP", .width = 380.0, .height = 180.0};
    pv.lines = {{"", workbench::palette::kGrey, minutes, cut(r.sp), true},
                {"", workbench::palette::kBlue, minutes, cut(r.true_pv)}};
    pv.y_range = workbench::PlotRange{4.3, 6.2};
    charts.push_back(std::move(pv));
    workbench::Chart co{
        .title = "", .x_label = "min", .y_label = "CO, stem", .width = 380.0, .height = 180.0};
    co.lines = {{"CO", workbench::palette::kVermilion, minutes, cut(r.co)},
                {"stem", workbench::palette::kBlue, minutes, cut(r.stem)}};
    co.y_range = workbench::PlotRange{3.2, 5.6};
    charts.push_back(std::move(co));
  };
  add("PI", [](control::ControllerSettings&) {});
  add("jacket: dwell", [](control::ControllerSettings& c) {
    c.jacket = {.form = control::JacketForm::dwell, .dead_zone = 0.03};
  });
  add("planned moves", [&](control::ControllerSettings& c) {
    c.compensator = {.kind = control::CompensatorKind::planned_moves,
                     .planned = {.gain = model.process.gain,
                                 .time_constant_s = model.process.time_constant_s,
                                 .dead_time_s = model.process.dead_time_s,
                                 .load = 0.006,
                                 .s = 0.8,
                                 .j = 0.4}};
  });
  return workbench::chart_sheet("One hour of a loop whose valve sticks", charts, 2);
}

template <class Study>
auto with_progress(const char* what, unsigned threads, Study&& study) {
  std::unique_ptr<workbench::Progress> line;
  return study(StudyWork{.threads = threads, .progress = [&](std::size_t done, std::size_t total) {
                           if (!line) line = std::make_unique<workbench::Progress>(what, total);
                           line->update(done);
                         }});
}

int print_troubles(const CalmOptions& options) {
  const std::vector<TroubleRow> rows = with_progress(
      "troubles", options.threads,
      [&](const StudyWork& work) { return study_troubles(options.cases, options.seed, work); });
  nlohmann::json result = nlohmann::json::array();
  if (!options.json) {
    fmt::print("{:<24} {:>22} {:>20}\n", "while it acts", "worse than PI by 30 %",
               "worst RMS over PI's");
  }
  for (const TroubleRow& row : rows) {
    if (options.json) {
      result.push_back(
          {{"trouble", to_text(row.kind)}, {"share_worse", row.share_worse}, {"worst", row.worst}});
    } else {
      fmt::print("{:<24} {:>20.1f} % {:>20.2f}\n", to_text(row.kind), 100.0 * row.share_worse,
                 row.worst);
    }
  }
  if (options.json) fmt::print("{}\n", result.dump(2));
  return kExitOk;
}

int print_rate_limits(const CalmOptions& options) {
  constexpr double kMost = 1.1;
  const std::vector<RateRow> rows = with_progress(
      "rate limits", options.threads,
      [&](const StudyWork& work) { return study_rate_limits(options.cases, options.seed, work); });
  const auto above = [](const std::vector<double>& factors) {
    return std::count_if(factors.begin(), factors.end(), [](double f) { return f > kMost; });
  };
  nlohmann::json result = nlohmann::json::array();
  if (!options.json) {
    fmt::print(
        "RMS of SP - PV with planned_moves over PI only, {} loops per row, seed {}\n"
        "PI twice: PI only with another noise over PI only\n\n",
        options.cases, options.seed);
    fmt::print("{:>12} {:>12} | {:>8} {:>8} {:>10} | {:>10} {:>10}\n", "rate limit", "read-back",
               "median", "worst", "above 1.1", "PI twice", "above 1.1");
    fmt::print("{:>12} {:>12} | {:>8} {:>8} {:>10} | {:>10} {:>10}\n", "%/s", "every, s", "", "",
               "loops", "worst", "loops");
  }
  for (const RateRow& row : rows) {
    const Spread spread = spread_of(row.factors);
    const Spread luck = spread_of(row.luck);
    if (options.json) {
      result.push_back(
          {{"percent_per_s", std::isfinite(row.percent_per_s) ? nlohmann::json(row.percent_per_s)
                                                              : nlohmann::json(nullptr)},
           {"read_back_s", row.read_back_s},
           {"median", spread.median},
           {"worst", spread.worst},
           {"above", above(row.factors)},
           {"luck_worst", luck.worst},
           {"luck_above", above(row.luck)},
           {"factors", row.factors}});
      continue;
    }
    const std::string rate =
        std::isfinite(row.percent_per_s) ? fmt::format("{:g}", row.percent_per_s) : "none";
    const std::string read_back =
        row.read_back_s > 0.0 ? fmt::format("{:g} to {:g}", row.read_back_s, 1.5 * row.read_back_s)
                              : "cycle";
    fmt::print("{:>12} {:>12} | {:>8.3f} {:>8.3f} {:>10} | {:>10.3f} {:>10}\n", rate, read_back,
               spread.median, spread.worst, above(row.factors), luck.worst, above(row.luck));
  }
  if (options.json) fmt::print("{}\n", result.dump(2));
  return kExitOk;
}

int run_calm_study(const CalmOptions& options) {
  if (!options.picture.empty()) {
    workbench::OutputFiles files;
    files.add(options.picture, hour_of_a_loop());
    files.commit();
    return kExitOk;
  }
  if (options.troubles) return print_troubles(options);
  if (options.rate_limits) return print_rate_limits(options);
  nlohmann::json result = {{"cases", options.cases}, {"seed", options.seed}};
  if (!options.json) {
    fmt::print(
        "Sticking valves: {} loops, seed {}. Factors of RMS of settled SP - PV and of stem travel\n"
        "against the same loop without compensator; whole: with set-point moves and settling.\n",
        options.cases, options.seed);
  }
  for (const Load load : {Load::steady, Load::wandering}) {
    const StickyStudy study =
        with_progress("sticking valves", options.threads, [&](const StudyWork& work) {
          return study_sticky_loops(options.cases, options.seed, load, options.only, work,
                                    options.friction ? Valve::physical : Valve::law);
        });
    result["sticky"].push_back(json_of(study));
    if (!options.json) print_sticky(study);
  }
  if (options.friction) {
    if (options.json) fmt::print("{}\n", result.dump(2));
    return kExitOk;
  }
  const HealthyStudy healthy =
      with_progress("healthy valves", options.threads, [&](const StudyWork& work) {
        return study_healthy_loops(options.cases, options.seed, work);
      });
  result["healthy"] = {{"share_rises", healthy.share_rises},
                       {"worst_rise_percent", healthy.worst_rise_percent}};
  if (options.json) {
    fmt::print("{}\n", result.dump(2));
  } else {
    fmt::print(
        "\nHealthy valves under planned_moves: RMS rises by more than 0.02 % of span in {:.1f} %, "
        "at most by {:.4f} %\n",
        100.0 * healthy.share_rises, healthy.worst_rise_percent);
  }
  return kExitOk;
}

}  // namespace

void add_calm(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<CalmOptions>();
  CLI::App* sub =
      app.add_subcommand("calm", "Test all compensators on loops with a sticking valve");
  sub->add_option("--cases", options->cases, "random loops, sticky and healthy")
      ->capture_default_str()
      ->check(CLI::Range(std::size_t{1}, std::size_t{100000}));
  sub->add_option("--seed", options->seed, "seed of all random numbers")->capture_default_str();
  sub->add_option("--only", options->only,
                  "only compensators whose name begins with this; 'commissioned' takes most of a "
                  "minute per loop");
  sub->add_flag("--troubles", options->troubles, "only planned_moves with a fault while they act");
  sub->add_flag("--rate-limits", options->rate_limits,
                "only planned_moves with the limits of hardware, with a rate limit of the output "
                "and with a slow read-back");
  sub->add_flag("--friction", options->friction,
                "valves with friction, air and process at 1 ms instead of a law of stiction");
  sub->add_option("--threads", options->threads, "the result does not depend on it")
      ->check(CLI::Range(1U, 1024U));
  sub->add_option("--picture", options->picture, "only draw one hour of a loop into this file");
  sub->add_flag("--json", options->json, "print the result as JSON, with the factor of each case");
  sub->footer("Example: loopwarden-study calm --cases 100 --seed 1");
  sub->callback([options, &exit_code] { exit_code = run_calm_study(*options); });
}

}  // namespace loopwarden::lab
