// SPDX-License-Identifier: Apache-2.0
// loopwarden train: trains specialists on the simulated loop, or on measured signatures.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "record/record_csv.hpp"
#include "workbench/command_line/frame.hpp"
#include "workbench/files/model_file.hpp"
#include "workbench/files/output_files.hpp"
#include "workbench/training/specialist_training.hpp"
#include "workbench/commands/subcommands.hpp"
#include "workbench/training/training_checkpoint.hpp"
#include "workbench/report/training_page.hpp"

namespace loopwarden::workbench {
namespace {

namespace fs = std::filesystem;
using specialist::Condition;

struct TrainOptions {
  std::string model;
  std::string signatures;
  std::string out;
  std::string plant = "P1";
  std::string form;  // empty: what the data allow and need least time
  std::uint64_t seed = 1;
  std::size_t windows = 16000;
  std::optional<std::size_t> restarts;
  std::size_t components = specialist::kSide;
  std::size_t most_epochs = 1000;
  std::vector<std::size_t> sizes{10, 20, 31};
  std::vector<std::string> classes;
  unsigned jobs = 0;
  bool json = false;
};

std::vector<std::string> cells_of(std::string line) {
  if (!line.empty() && line.back() == '\r') line.pop_back();
  std::vector<std::string> cells;
  std::istringstream in(line);
  for (std::string cell; std::getline(in, cell, ',');) cells.push_back(cell);
  return cells;
}

std::vector<double> read_signature(const fs::path& path) {
  const record::Record record = record::read_record(path);
  if (record.size() != specialist::kSignatureSamples) {
    fail(kExitData, "{}: a signature has {} samples (got {})", path.string(),
         specialist::kSignatureSamples, record.size());
  }
  for (const double value : record.pv) {
    if (!std::isfinite(value)) {
      fail(kExitData, "{}: a signature has no missing samples", path.string());
    }
  }
  return record.pv;
}

// Reads labels.csv: file, class, plant, role. Files without a role are divided 3 : 1 : 1 in order.
std::vector<specialist::Signature> read_signatures(const fs::path& folder,
                                                   const std::string& plant) {
  const fs::path path = folder / "labels.csv";
  std::ifstream in(path);
  if (!in) fail(kExitData, "{}: can't be read", path.string());
  std::string line;
  std::getline(in, line);
  const std::vector<std::string> header = cells_of(line);
  const auto column = [&](const std::string& name) {
    const auto found = std::find(header.begin(), header.end(), name);
    if (found == header.end()) {
      fail(kExitData, "{}:1: no column '{}'; columns are file, class, plant, role", path.string(),
           name);
    }
    return static_cast<std::size_t>(found - header.begin());
  };
  const std::size_t file = column("file");
  const std::size_t condition = column("class");
  const std::size_t of_plant = column("plant");
  const std::size_t role = column("role");
  std::vector<specialist::Signature> signatures;
  std::array<std::size_t, specialist::kKnownConditions> seen{};
  for (std::size_t number = 2; std::getline(in, line); ++number) {
    std::vector<std::string> cells = cells_of(line);
    if (cells.empty()) continue;
    cells.resize(std::max(cells.size(), header.size()));
    if (cells[of_plant] != plant) continue;
    const auto known = specialist::condition_of(cells[condition]);
    if (!known) {
      fail(kExitData,
           "{}:{}: unknown class '{}'; one of no_fault, stiction, backlash, hysteresis, "
           "low_air_supply",
           path.string(), number, cells[condition]);
    }
    specialist::Signature s;
    s.condition = *known;
    s.role = specialist::role_of(seen[static_cast<std::size_t>(*known)]++);
    const std::string& word = cells[role];
    if (word == "training") {
      s.role = specialist::Role::training;
    } else if (word == "validation") {
      s.role = specialist::Role::validation;
    } else if (word == "test") {
      s.role = specialist::Role::test;
    } else if (!word.empty()) {
      fail(kExitData, "{}:{}: unknown role '{}'; training, validation, test or empty",
           path.string(), number, word);
    }
    s.pv = read_signature(folder / cells[file]);
    signatures.push_back(std::move(s));
  }
  if (signatures.empty()) {
    fail(kExitData, "{}: no signature of plant '{}'", path.string(), plant);
  }
  return signatures;
}

void print_summary(const TrainOptions& options, const TrainingResult& result, double seconds) {
  const config::SpecialistFolder& f = result.folder;
  if (options.json) {
    nlohmann::json specialists = nlohmann::json::array();
    if (f.team) {
      for (const auto& m : f.team->members) {
        specialists.push_back(
            {{"name", m.name}, {"form", "explaining"}, {"class", to_text(m.condition)}});
      }
    }
    for (const auto& m : f.signatures) {
      specialists.push_back(
          {{"name", m.name}, {"form", "signature"}, {"class", to_text(m.condition)}});
    }
    nlohmann::json out = {{"folder", options.out},
                          {"plant", f.plant},
                          {"seed", options.seed},
                          {"seconds", seconds},
                          {"specialists", std::move(specialists)},
                          {"figures", nullptr}};
    if (f.figures) {
      out["figures"] = {{"windows", f.figures->windows},
                        {"named_percent", f.figures->named_percent},
                        {"false_alarm_percent", f.figures->false_alarm_percent},
                        {"undecided_percent", f.figures->undecided_percent},
                        {"calibration_error", f.figures->calibration_error}};
    }
    show_json(out);
    return;
  }
  fmt::print("{}: {} specialists in {:.1f} s, seed {}\n", options.out,
             (f.team ? specialist::kConditions : 0) + f.signatures.size(), seconds, options.seed);
  if (f.figures) {
    fmt::print(
        "explaining form on {} held-out simulated windows: {:.1f} % of the faulty ones named, "
        "{:.2f} % of the others called a fault,\n{:.1f} % of all without enough movement; "
        "calibration error {:.3f}\n",
        f.figures->windows, f.figures->named_percent, f.figures->false_alarm_percent,
        f.figures->undecided_percent, f.figures->calibration_error);
  }
  fmt::print("errors over epochs: {}\n", (fs::path(options.out) / "training.html").string());
}

TrainingListener listener_of(bool quiet) {
  const bool terminal = isatty(STDERR_FILENO) == 1;
  TrainingListener listener;
  if (!quiet) {
    listener.say = [terminal](const std::string& text) {
      fmt::print(stderr, "{}{}\n", terminal ? "\r\x1b[K" : "", text);
    };
  }
  if (terminal) {
    listener.live = [](const std::string& text) {
      fmt::print(stderr, "\r{}\x1b[K", text);
      std::fflush(stderr);
    };
  }
  return listener;
}

// Returns the model's effects between CO and PV that the explaining form does not have.
void warn_of_effects(const plant::LoopModel& model) {
  std::string names;
  if (model.process.second_time_constant_s > 0.0) names += " second_time_constant";
  for (const auto* effects :
       {&model.valve_effects, &model.process_effects, &model.transmitter_effects}) {
    for (const effects::EffectSpec& effect : *effects) names += " " + effect.name;
  }
  if (!names.empty()) {
    fmt::print(stderr,
               "warning: the explaining form models gain, lag and dead time. It treats these "
               "effects of the model as healthy only as far as they resemble those:{}\n",
               names);
  }
}

// A folder is replaced only if its manifest is ours, because other folders may contain the user's
// files.
void check_replaceable(const fs::path& folder) {
  const fs::path manifest = folder / "manifest.yaml";
  std::ifstream in(manifest);
  if (!in) return;
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("format: loopwarden-specialists")) return;
  }
  fail(kExitUsage, "{}: not written by loopwarden train; give --out another folder",
       manifest.string());
}

int run_train(const TrainOptions& options) {
  if (options.model.empty() == options.signatures.empty()) {
    fail(kExitUsage, "train: give a model, or --signatures, and not both");
  }
  TrainingJob job;
  job.plant = options.plant;
  const std::string form = !options.form.empty()   ? options.form
                           : options.model.empty() ? "signature"
                                                   : "explaining";
  job.explaining = form != "signature" && !options.model.empty();
  job.signature = form != "explaining";
  if (!job.explaining && !job.signature) {
    fail(kExitUsage, "train: the explaining form needs a model: signatures have no CO");
  }
  job.team.seed = job.growing.seed = options.seed;
  job.team.windows = options.windows;
  if (options.restarts) job.team.restarts = job.growing.restarts = *options.restarts;
  job.growing.components = options.components;
  job.growing.learning.most_epochs = options.most_epochs;
  job.growing.sizes = options.sizes;
  if (!options.classes.empty()) {
    job.conditions.clear();
    for (const std::string& name : options.classes) {
      job.conditions.push_back(*specialist::condition_of(name));
    }
  }
  job.threads = threads(options.jobs);
  job.checkpoint = fs::path(options.out) / "unfinished";
  check_replaceable(options.out);
  OutputFiles files({options.model});
  files.make_folder(options.out);
  try {
    if (!options.model.empty()) {
      job.model = load_model(options.model);
      if (job.model->process.integrating()) {
        fail(kExitConfiguration,
             "{}: specialists are available for self-regulating processes, not for integrating "
             "ones (process.kind)",
             options.model);
      }
      warn_of_effects(*job.model);
      job.source = "simulated loop of " + fs::path(options.model).filename().string();
    } else {
      job.signatures = read_signatures(options.signatures, options.plant);
      job.source = fmt::format("{} measured signatures of {}", job.signatures.size(),
                               fs::path(options.signatures).filename().string());
    }
    const auto begin = std::chrono::steady_clock::now();
    const TrainingResult result = train_specialists(job, listener_of(options.json));
    const double seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    files.add(fs::path(options.out) / "training.html", training_page(result));
    const std::vector<std::string> old_weights = config::weight_files(options.out);
    config::write_specialists(result.folder, options.out,
                              [&](const std::string& name, const std::string& text) {
                                files.add(fs::path(options.out) / name, text);
                              });
    files.commit();
    config::remove_weights(options.out, old_weights);
    TrainingCheckpoint::remove(*job.checkpoint);
    print_summary(options, result, seconds);
  } catch (const std::invalid_argument& e) {
    fail(options.model.empty() ? kExitData : kExitConfiguration, "train: {}", e.what());
  }
  return kExitOk;
}

}  // namespace

void add_train(Program& program) {
  auto [command, o] =
      program.command("train", "Train specialists that distinguish valve faults", run_train);
  command.option("model", o.model, "loop model, YAML: train on its simulation");
  command.option("--signatures", o.signatures,
                 "folder of measured signatures with labels.csv: file, class, plant, role");
  command.required("--out", o.out, "folder for the specialists");
  command.setting("--plant", o.plant, "prefix of their names; with --signatures, the plant to use",
                  checked([](const std::string& name) {
                    const bool good = !name.empty() && name.size() <= 16 &&
                                      std::all_of(name.begin(), name.end(), [](char c) {
                                        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
                                               (c >= '0' && c <= '9') || c == '-' || c == '_';
                                      });
                    return good ? std::string()
                                : std::string("letters, digits, - and _, at most 16");
                  }));
  command.option("--form", o.form,
                 "explaining: any window, from CO and PV, the default with a model; signature: the "
                 "thesis's networks, with --signatures the only ones; both takes minutes",
                 one_of({"both", "explaining", "signature"}));
  command.setting("--seed", o.seed, "seed of all random numbers");
  command.setting("--windows", o.windows, "simulated windows of the explaining form",
                  between(700, 1000000));
  command.option("--restarts", o.restarts,
                 "starts of each network; default 2, of the signature form 1", between(1, 32));
  command.setting("--components", o.components,
                  "principal components that the signature form reduces its inputs to; 31: all",
                  between(1, 31));
  command.setting("--epochs", o.most_epochs, "most epochs of the signature form",
                  between(1, 100000));
  command.setting("--sizes", o.sizes, "neurons of the hidden layers to grow over", between(1, 64))
      .delimiter(',');
  command
      .option("--classes", o.classes, "of the signature form with a model; default: all five",
              one_of({"no_fault", "stiction", "backlash", "hysteresis", "low_air_supply"}))
      .delimiter(',');
  command.setting("--jobs", o.jobs, "threads; 0: one per core. The result does not depend on it");
  command.flag("--json", o.json, "print the result as JSON");
  command.footer(
      "After an interruption, the same command continues the run: finished parts in "
      "DIR/unfinished\nare reused, and a network that was in training starts again.\n"
      "Example: loopwarden train examples/models/plant1-believed.yaml --out specialists");
}

}  // namespace loopwarden::workbench
