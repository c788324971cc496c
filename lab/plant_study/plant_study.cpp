// SPDX-License-Identifier: Apache-2.0
// loopwarden-study plant: exports a simulated plant for the survey, and scores the survey's
// ranking.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <thread>

#include "base/parallel.hpp"
#include "record/import/time_text.hpp"
#include "lab/plant_study/simulated_plant.hpp"
#include "lab/program/studies.hpp"
#include "workbench/command_line/progress.hpp"
#include "workbench/files/command_error.hpp"
#include "workbench/files/output_files.hpp"

namespace loopwarden::lab {
namespace {

namespace fs = std::filesystem;

struct PlantOptions {
  PlantSettings plant;
  std::string out;
  std::string score;
  unsigned threads = std::max(1U, std::thread::hardware_concurrency());
};

constexpr std::int64_t kStart = 1772323200;  // 2026-03-01T00:00:00Z

void write_unit(const PlantOptions& options, const std::vector<SimulatedTag>& tags,
                std::size_t unit) {
  const std::size_t a_day = static_cast<std::size_t>(86400.0 / options.plant.period_s);
  for (std::size_t day = 0; day < options.plant.days; ++day) {
    std::string text = "Timestamp";
    for (const SimulatedTag& tag : tags) text += fmt::format(",{0}.PV,{0}.OP,{0}.SP", tag.tag);
    text += "\n";
    for (std::size_t k = day * a_day; k < (day + 1) * a_day; ++k) {
      const double at_s = static_cast<double>(k) * options.plant.period_s;
      text += record::iso_text(kStart + static_cast<std::int64_t>(at_s), 0.0, true);
      for (const SimulatedTag& tag : tags) {
        fmt::format_to(std::back_inserter(text), ",{:.3f},{:.2f},{:.2f}", tag.pv[k], tag.co[k],
                       tag.sp[k]);
      }
      text += "\n";
    }
    workbench::write_output(
        fs::path(options.out) / fmt::format("unit{:04}_day{:03}.csv", unit + 1, day + 1), text);
  }
}

int write_plant(const PlantOptions& options) {
  workbench::OutputFiles folder;
  folder.make_folder(options.out);
  folder.commit();
  const std::size_t units =
      (options.plant.loops + options.plant.loops_a_unit - 1) / options.plant.loops_a_unit;
  std::vector<std::string> truth(units);
  workbench::Progress progress("plant", units);
  base::parallel_for(
      units, options.threads,
      [&](std::size_t unit) {
        const std::vector<SimulatedTag> tags = simulate_unit(options.plant, unit);
        for (const SimulatedTag& tag : tags)
          truth[unit] += fmt::format("{},{},{:.2f}\n", tag.tag, tag.truth, tag.size);
        write_unit(options, tags, unit);
      },
      [&](std::size_t done) { progress.update(done); });
  std::string all = "tag,truth,size\n";
  for (const std::string& lines : truth) all += lines;
  // Written outside the folder of exports, because it is no export.
  workbench::write_output(options.out + ".truth.csv", all);
  fmt::print("{} loops, {} days, {} files in {}; true faults: {}.truth.csv\n", options.plant.loops,
             options.plant.days, units * options.plant.days, options.out, options.out);
  return kExitOk;
}

// Prints a table with the true faults as rows and the survey's verdicts as columns.
int score(const PlantOptions& options) {
  std::ifstream truth_file(options.out + ".truth.csv");
  std::ifstream survey_file(fs::path(options.score) / "survey.json");
  if (!truth_file || !survey_file) {
    throw workbench::CommandError(
        kExitIo,
        fmt::format("{}.truth.csv, {}/survey.json: can't be read", options.out, options.score));
  }
  const nlohmann::json survey = nlohmann::json::parse(survey_file, nullptr, false);
  if (!survey.is_object()) throw workbench::CommandError(kExitData, "survey.json: is damaged");
  std::map<std::string, std::string> said;
  for (const nlohmann::json& loop : survey.at("loops")) {
    std::string verdict = loop.at("verdict");
    if (verdict == "valve_effect") verdict = loop.at("effects").at(0).at("name");
    if (verdict == "other_cause") verdict = loop.at("cause");
    said[loop.at("tag")] = verdict;
  }
  std::map<std::string, std::map<std::string, std::size_t>> table;
  std::string line;
  std::getline(truth_file, line);
  while (std::getline(truth_file, line)) {
    std::istringstream cells(line);
    std::string tag;
    std::string truth;
    std::getline(cells, tag, ',');
    std::getline(cells, truth, ',');
    const auto at = said.find(tag);
    ++table[truth][at == said.end() ? "not in the survey" : at->second];
  }
  for (const auto& [truth, row] : table) {
    std::size_t all = 0;
    std::string text;
    for (const auto& [verdict, count] : row) {
      all += count;
      text += fmt::format("  {} {}", verdict, count);
    }
    fmt::print("{:<10} {:>6} {}\n", truth, all, text);
  }
  return kExitOk;
}

}  // namespace

void add_plant(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<PlantOptions>();
  CLI::App* sub =
      app.add_subcommand("plant", "Export a simulated plant for the survey, and score its ranking");
  sub->add_option("--out", options->out, "folder of the exports")->required();
  sub->add_option("--loops", options->plant.loops, "how many")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  sub->add_option("--days", options->plant.days, "how long")
      ->check(CLI::Range(1, 3660))
      ->capture_default_str();
  sub->add_option("--period", options->plant.period_s, "s, of the samples")
      ->check(CLI::Range(1.0, 600.0))
      ->capture_default_str();
  sub->add_option("--seed", options->plant.seed, "of the plant")->capture_default_str();
  sub->add_option("--jobs", options->threads, "threads; the files do not depend on it")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str();
  sub->add_option("--score", options->score,
                  "folder of a survey of --out: compare its verdicts with the truth");
  sub->footer("Example: loopwarden-study plant --loops 200 --out plant");
  sub->callback([options, &exit_code] {
    exit_code = options->score.empty() ? write_plant(*options) : score(*options);
  });
}

}  // namespace loopwarden::lab
