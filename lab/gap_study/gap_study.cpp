// SPDX-License-Identifier: Apache-2.0
// loopwarden-study gap: scores `loopwarden gap` on cases with a known truth.
#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <stdlib.h>
#include <unistd.h>

#include <cstdint>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <string>
#include <system_error>
#include <vector>

#include "lab/gap_study/gap_runner.hpp"
#include "lab/gap_study/study_report.hpp"
#include "lab/program/studies.hpp"

namespace loopwarden::lab {
namespace {

namespace cases = gap_study;
namespace fs = std::filesystem;

// Returns the path of a program of the same build.
std::string beside(const char* name) {
  return (fs::read_symlink("/proc/self/exe").parent_path() / name).string();
}

struct Options {
  std::vector<std::string> folders;
  std::string gap = beside("loopwarden");
  std::string generator = beside("loopwarden_hidden_cases");
  std::vector<std::string> gap_options;
  unsigned jobs = 2;
  bool json = false;
  bool list = false;
  std::size_t generate = 0;
  std::uint64_t seed = 0;
  bool load = false;
  bool load_only = false;
  double time_limit_s = 120.0;
  std::string kinds = "single,none,pair,outside";
  std::size_t samples = 4200;
  std::string only;
  std::string keep;
  bool resume = false;
  bool without_truth = false;
};

// A temporary folder that is removed at the end.
class WorkFolder {
 public:
  WorkFolder() {
    std::string name = (fs::temp_directory_path() / "gap-study-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder");
    path_ = name;
  }
  WorkFolder(const WorkFolder&) = delete;
  WorkFolder& operator=(const WorkFolder&) = delete;
  ~WorkFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

void generate(const Options& options, bool load, std::uint64_t seed, const fs::path& folder) {
  cases::make_cases(options.generator,
                    {.count = options.generate,
                     .seed = seed,
                     .kinds = options.kinds,
                     .samples = options.samples,
                     .load = load},
                    folder);
}

// Returns the folders to score; generated ones are created under `work`.
std::vector<fs::path> folders_of(const Options& options, const fs::path& work) {
  std::vector<fs::path> folders(options.folders.begin(), options.folders.end());
  if (options.generate == 0) return folders;
  if (!options.load_only) {
    generate(options, false, options.seed, work / "hidden");
    folders.push_back(work / "hidden");
  }
  if (options.load || options.load_only) {
    generate(options, true, options.seed + (options.load_only ? 0 : options.generate),
             work / "hidden-load");
    folders.push_back(work / "hidden-load");
  }
  return folders;
}

bool has_load(fs::path folder) {
  folder = fs::absolute(folder).lexically_normal();
  if (!folder.has_filename()) folder = folder.parent_path();
  const fs::path holder =
      fs::exists(folder / "truth.json") ? folder.filename() : folder.parent_path().filename();
  return holder.string().find("load") != std::string::npos;
}

std::vector<cases::CaseFiles> cases_of(const Options& options, const fs::path& folder) {
  std::vector<cases::CaseFiles> found;
  for (cases::CaseFiles& one : cases::find_cases(folder)) {
    if (one.truth.effect.find(options.only) != std::string::npos) found.push_back(std::move(one));
  }
  return found;
}

cases::StudyPart run_part(const Options& options, const std::vector<fs::path>& folders, bool load,
                          const fs::path& out) {
  cases::StudyPart part;
  part.load = load;
  part.name = load ? "load" : "no load";
  std::size_t place = 0;
  for (const fs::path& folder : folders) {
    if (has_load(folder) != load) continue;
    const std::vector<cases::CaseFiles> found = cases_of(options, folder);
    const auto progress = [&](std::size_t done) {
      if (::isatty(STDERR_FILENO) != 0) {
        fmt::print(stderr, "\r{}: {} of {}", part.name, done, found.size());
        if (done == found.size()) fmt::print(stderr, "\n");
      } else if (done % 10 == 0 || done == found.size()) {
        fmt::print(stderr, "{}: {} of {}\n", part.name, done, found.size());
      }
    };
    // Different folders may use the same ids.
    const fs::path results = out / fmt::format("{}{}", load ? "load" : "no-load", place++);
    const cases::GapProgram program{.path = options.gap,
                                    .time_limit_s = options.time_limit_s,
                                    .options = options.gap_options,
                                    .without_truth = options.without_truth,
                                    .resume = options.resume};
    for (cases::ScoredCase& one :
         cases::run_cases(program, found, results, options.jobs, progress)) {
      part.cases.push_back(std::move(one));
    }
  }
  return part;
}

int study(const Options& options) {
  if (options.folders.empty() && options.generate == 0) {
    throw std::invalid_argument("no cases to score. Give --cases or --generate");
  }
  if (options.resume && options.keep.empty()) {
    throw std::invalid_argument("--resume needs --keep, the folder of the earlier answers");
  }
  const WorkFolder work;
  const fs::path out = options.keep.empty() ? work.path() / "results" : fs::path(options.keep);
  const std::vector<fs::path> folders = folders_of(options, work.path());
  std::vector<cases::StudyPart> parts;
  for (const bool load : {false, true}) {
    cases::StudyPart part = run_part(options, folders, load, out);
    if (!part.cases.empty()) parts.push_back(std::move(part));
  }
  if (options.json) {
    fmt::print("{}", cases::study_json(parts));
    return 0;
  }
  if (options.list) {
    for (const cases::StudyPart& part : parts) fmt::print("{}\n", cases::list_text(part));
  }
  fmt::print("{}\n", cases::table_text(parts));
  for (const cases::StudyPart& part : parts) fmt::print("{}\n", cases::confidence_text(part));
  for (const cases::StudyPart& part : parts) fmt::print("{}\n", cases::confusion_text(part));
  return 0;
}

void add_options(CLI::App& app, Options& options) {
  app.add_option("--cases", options.folders,
                 "folders with truth.json and cases; 'load' in the name puts them in that column");
  app.add_option("--gap", options.gap, "the loopwarden program")
      ->check(CLI::ExistingFile)
      ->capture_default_str();
  app.add_option("--generator", options.generator, "the program that makes cases")
      ->check(CLI::ExistingFile)
      ->capture_default_str();
  app.add_option("--gap-option", options.gap_options,
                 "passed on to the program, once for each word: --gap-option=--without "
                 "--gap-option=several")
      ->allow_extra_args(false);
  app.add_option("--jobs", options.jobs, "records at a time")
      ->check(CLI::Range(1, 256))
      ->capture_default_str();
  app.add_option("--time-limit", options.time_limit_s, "s for a record; longer is a failure")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_flag("--json", options.json, "figures and cases as JSON");
  app.add_flag("--list", options.list, "one line per case");
  auto* generate =
      app.add_option("--generate", options.generate, "number of cases to make and score");
  auto* seed = app.add_option("--seed", options.seed, "for --generate");
  generate->needs(seed);
  app.add_flag("--load", options.load, "with --generate: as many again with an unmeasured load")
      ->needs(generate);
  app.add_flag("--load-only", options.load_only, "with --generate: all with an unmeasured load")
      ->needs(generate)
      ->excludes("--load");
  app.add_option("--kinds", options.kinds,
                 "for --generate: of single, none, pair, outside, onset, controller, further")
      ->capture_default_str();
  app.add_option("--samples", options.samples, "for --generate: rows of a record")
      ->check(CLI::Range(600, 100000))
      ->capture_default_str();
  app.add_option("--only", options.only, "only truths whose name contains this");
  app.add_option("--keep", options.keep, "folder for the output of the program");
  app.add_flag("--resume", options.resume,
               "reuse the answers in the folder of --keep, of the same cases and program");
  app.add_flag("--without-truth", options.without_truth,
               "remove the correct names from the catalogue, case by case");
}

// Returns the exit code of the error.
int run_study(const Options& options) {
  try {
    return study(options);
  } catch (const std::invalid_argument& e) {
    fmt::print(stderr, "loopwarden-study gap: {}\n", e.what());
    return kExitUsage;
  } catch (const std::system_error& e) {
    fmt::print(stderr, "loopwarden-study gap: {}\n", e.what());
    return kExitIo;
  } catch (const std::exception& e) {
    fmt::print(stderr, "loopwarden-study gap: {}\n", e.what());
    return kExitData;
  }
}

}  // namespace

void add_gap(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<Options>();
  CLI::App* sub = app.add_subcommand("gap", "Score loopwarden gap on cases with a known truth");
  add_options(*sub, *options);
  sub->footer("Example: loopwarden-study gap --generate 23 --seed 1 --load");
  sub->callback([options, &exit_code] { exit_code = run_study(*options); });
}

}  // namespace loopwarden::lab
