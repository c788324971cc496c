// SPDX-License-Identifier: Apache-2.0
// loopwarden-study calm: the tables of calm_study.hpp, as text or JSON.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "studies/calm/calm_study.hpp"
#include "studies/program/studies.hpp"
#include "workbench/command_line/progress.hpp"

namespace loopwarden::studies {
namespace {

struct CalmOptions {
  std::size_t cases = 100;
  std::uint64_t seed = 1;
  std::string only;
  unsigned threads = std::max(1U, std::thread::hardware_concurrency());
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
                    {"factors", row.factors}});
  }
  return {{"load", name_of(study.load)}, {"rows", rows}};
}

template <class Study>
auto with_progress(const char* what, unsigned threads, Study&& study) {
  std::unique_ptr<workbench::Progress> line;
  return study(StudyWork{.threads = threads, .progress = [&](std::size_t done, std::size_t total) {
                           if (!line) line = std::make_unique<workbench::Progress>(what, total);
                           line->update(done);
                         }});
}

int run_calm_study(const CalmOptions& options) {
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
          return study_sticky_loops(options.cases, options.seed, load, options.only, work);
        });
    result["sticky"].push_back(json_of(study));
    if (!options.json) print_sticky(study);
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
      app.add_subcommand("calm", "what each compensator does to loops with a sticking valve");
  sub->add_option("--cases", options->cases, "random loops, sticky and healthy")
      ->capture_default_str()
      ->check(CLI::Range(std::size_t{1}, std::size_t{100000}));
  sub->add_option("--seed", options->seed, "of everything random")->capture_default_str();
  sub->add_option("--only", options->only, "only contestants whose name begins so");
  sub->add_option("--threads", options->threads, "the result does not depend on it")
      ->check(CLI::Range(1U, 1024U));
  sub->add_flag("--json", options->json, "print the result as JSON, with the factor of each case");
  sub->footer("Example: loopwarden-study calm --cases 100 --seed 1");
  sub->callback([options, &exit_code] { exit_code = run_calm_study(*options); });
}

}  // namespace loopwarden::studies
