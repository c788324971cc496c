// SPDX-License-Identifier: Apache-2.0
// loopwarden-study plant1: writes the table and the pictures of lab/results/plant1.md.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "record/record_csv.hpp"
#include "workbench/files/output_files.hpp"
#include "lab/plant1/plant1_study.hpp"
#include "workbench/command_line/progress.hpp"
#include "lab/program/studies.hpp"

namespace loopwarden::lab {
namespace {

struct Plant1Options {
  std::string data = "examples/plant1";
  std::string out;
  std::size_t generations = Plant1Work{}.generations;
  bool from_healthy = false;
  std::uint64_t seed = 1;
  unsigned threads = std::max(1U, std::thread::hardware_concurrency());
  bool json = false;
};

// The records as examples/plant1/README.md lists them.
constexpr std::pair<const char*, const char*> kRecords[] = {{"P1N22", "no_fault"},
                                                            {"P1B22", "backlash"},
                                                            {"P1L21", "low_air_supply"},
                                                            {"P1S22", "stiction"},
                                                            {"P1H16", "hysteresis"}};
constexpr std::size_t kFewestSamples = 100;

std::vector<Plant1Record> read_records(const std::filesystem::path& folder) {
  using record::RecordError;
  std::vector<Plant1Record> records;
  for (const auto& [name, condition] : kRecords) {
    const std::filesystem::path path = folder / (std::string(name) + ".csv");
    record::Record record = record::read_record(path);
    const auto refuse = [&](const char* why) {
      throw RecordError(RecordError::Kind::data, 0, 0, path.string() + ": " + why);
    };
    if (numeric::missing(record.pv) > 0) refuse("samples of pv are missing");
    if (record.size() < kFewestSamples) refuse("fewer than 100 samples");
    if (std::abs(record.period_s - kPlant1PeriodS) > 1e-3) refuse("the period is not 0.1 s");
    records.push_back(plant1_record(name, condition, std::move(record.pv)));
    if (!(records.back().variance > 0.0)) refuse("pv never changes");
  }
  return records;
}

// Returns "deadband 12.4, ...", the parameters after those that all records have.
std::string parameters_of(const Plant1Trial& trial) {
  const std::vector<FitBound>& bounds = plant1_candidate(trial.label).bounds;
  std::string text;
  for (std::size_t i = 0; i < bounds.size(); ++i) {
    text += fmt::format("{}{} {:.3g}", i > 0 ? ", " : "", bounds[i].name,
                        trial.own[plant1_own_bounds().size() + i]);
  }
  return text;
}

// A stiction made with the cam counts as correct under both names.
bool named_right(const Plant1Outcome& row) {
  const std::string& name = row.trials.front().name;
  if (row.record.condition == "no_fault") return name == "none";
  return name == row.record.condition ||
         (row.record.condition == "stiction" && name == "cam_obstruction");
}

void print_tables(const Plant1Study& study) {
  fmt::print("fit %, free closed-loop run from rest: 100 (1 - rmse / std of PV)\n\n");
  fmt::print("{:<8}{:<16}{:>10}{:>11}{:>9}{:>9}\n", "record", "condition", "published", "corrected",
             "divisor", "step at");
  for (const Plant1Outcome& row : study.rows) {
    fmt::print("{:<8}{:<16}{:>10.1f}{:>11.1f}{:>9.2f}{:>7.2f} s\n", row.record.name,
               row.record.condition, fit_percent(row.published_misfit),
               fit_percent(row.corrected_misfit), row.own[0], row.own[1]);
  }
  fmt::print("\nshared plant:\n");
  for (std::size_t i = 0; i < study.shared.size(); ++i) {
    fmt::print("  {:<18}{:>8.3f}\n", plant1_shared_bounds()[i].name, study.shared[i]);
  }
  for (const Plant1Outcome& row : study.rows) {
    fmt::print("\n{} ({}): {}{}\n", row.record.name, row.record.condition, row.trials.front().name,
               named_right(row) ? "" : "   <- not what was put in");
    fmt::print("  {:<26}{:>7}{:>8}{:>9}  parameters\n", "added", "fit %", "score", "divisor");
    for (const Plant1Trial& trial : row.trials) {
      fmt::print("  {:<26}{:>7.1f}{:>8.1f}{:>9.2f}  {}\n", trial.label, fit_percent(trial.misfit),
                 trial.score, trial.own[0], parameters_of(trial));
    }
  }
}

void print_json(const Plant1Study& study, std::uint64_t seed) {
  nlohmann::json result = {{"seed", seed}, {"shared", nlohmann::json::object()}};
  for (std::size_t i = 0; i < study.shared.size(); ++i)
    result["shared"][plant1_shared_bounds()[i].name] = study.shared[i];
  for (const Plant1Outcome& row : study.rows) {
    nlohmann::json one = {{"record", row.record.name},
                          {"condition", row.record.condition},
                          {"published_fit_percent", fit_percent(row.published_misfit)},
                          {"corrected_fit_percent", fit_percent(row.corrected_misfit)},
                          {"divisor", row.own[0]},
                          {"step_at_s", row.own[1]},
                          {"named", row.trials.front().name},
                          {"named_right", named_right(row)}};
    for (const Plant1Trial& trial : row.trials) {
      const std::vector<FitBound>& bounds = plant1_candidate(trial.label).bounds;
      nlohmann::json parameters = nlohmann::json::object();
      for (std::size_t i = 0; i < bounds.size(); ++i)
        parameters[bounds[i].name] = trial.own[plant1_own_bounds().size() + i];
      one["candidates"].push_back({{"name", trial.name},
                                   {"label", trial.label},
                                   {"fit_percent", fit_percent(trial.misfit)},
                                   {"score", trial.score},
                                   {"divisor", trial.own[0]},
                                   {"parameters", parameters}});
    }
    result["records"].push_back(std::move(one));
  }
  fmt::print("{}\n", result.dump(2));
}

void write_pictures(const Plant1Study& study, const std::filesystem::path& folder) {
  workbench::OutputFiles files;
  files.make_folder(folder);
  for (const Plant1Outcome& row : study.rows) {
    files.add(folder / ("plant1-" + row.record.name + ".svg"), plant1_picture(row));
  }
  files.commit();
}

int run_plant1_study(const Plant1Options& options) {
  try {
    const std::vector<Plant1Record> records = read_records(options.data);
    constexpr std::size_t kSteps = 1000;
    workbench::Progress progress("plant1", kSteps);
    const Plant1Study study =
        study_plant1_records(records, {.seed = options.seed,
                                       .generations = options.generations,
                                       .from_healthy = options.from_healthy,
                                       .threads = options.threads,
                                       .progress = [&](std::size_t done, std::size_t total) {
                                         progress.update(kSteps * done / total);
                                       }});
    if (options.json) {
      print_json(study, options.seed);
    } else {
      print_tables(study);
    }
    if (!options.out.empty()) write_pictures(study, options.out);
  } catch (const record::RecordError& e) {
    fmt::print(stderr, "{}\n", e.what());
    return e.kind() == record::RecordError::Kind::io ? kExitIo : kExitData;
  }
  return kExitOk;
}

}  // namespace

void add_plant1(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<Plant1Options>();
  CLI::App* sub = app.add_subcommand(
      "plant1", "Find the deficits of the published model of plant 1 from its measured signatures");
  sub->add_option("--data", options->data, "folder of the five records")->capture_default_str();
  sub->add_option("--out", options->out, "folder for the pictures, SVG; default: no pictures");
  sub->add_option("--generations", options->generations, "of the joint fit, on each island")
      ->check(CLI::Range(std::size_t{1}, std::size_t{1'000'000}))
      ->capture_default_str();
  sub->add_option("--seed", options->seed, "of the search")->capture_default_str();
  sub->add_option("--threads", options->threads, "the result does not depend on it")
      ->check(CLI::Range(1U, 256U));
  sub->add_flag("--from-healthy", options->from_healthy,
                "fit plant, divisor and step time to the healthy record only, and hold them");
  sub->add_flag("--json", options->json, "print the result as JSON");
  sub->footer("Example: loopwarden-study plant1 --data examples/plant1 --out pictures");
  sub->callback([options, &exit_code] { exit_code = run_plant1_study(*options); });
}

}  // namespace loopwarden::lab
