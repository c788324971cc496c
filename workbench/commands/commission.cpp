// SPDX-License-Identifier: Apache-2.0
// loopwarden commission: makes the twin and the specialists of a healthy loop from its records, and
// measures their detection limits.
#include "model/twin/commission.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "base/text.hpp"
#include "config/loop_model_writer.hpp"
#include "config/specialists/specialist_folder.hpp"
#include "model/effects/descriptor.hpp"
#include "model/twin/twin_diff.hpp"
#include "model/twin/detectability.hpp"
#include "daemon/protocol/ask.hpp"
#include "record/record_csv.hpp"
#include "workbench/command_line/frame.hpp"
#include "workbench/records/record_input.hpp"
#include "workbench/records/recorder_input.hpp"
#include "workbench/command_line/progress.hpp"
#include "workbench/commands/subcommands.hpp"
#include "workbench/files/model_file.hpp"
#include "workbench/files/output_files.hpp"
#include "workbench/live/daemon_client.hpp"
#include "workbench/report/commission_page.hpp"
#include "workbench/text/commission_json.hpp"
#include "workbench/training/specialist_training.hpp"

namespace loopwarden::workbench {
namespace {

namespace fs = std::filesystem;

struct CommissionOptions {
  RecordInput input;
  std::vector<std::string> records;
  RecorderInput recorder;  // in place of records
  std::string model;
  std::string again;  // an earlier twin
  std::string out;
  std::string plant = "twin";
  std::vector<double> pv_range, co_range;  // of the loop; empty: of the daemon's loop, or assumed
  double healthy_limit_percent = 1.0;
  bool accept_short = false;
  std::uint64_t seed = 1;
  std::size_t windows = 12000;
  unsigned jobs = 0;
  bool json = false;
};

const char* advice(twin::Outcome outcome) {
  switch (outcome) {
    case twin::Outcome::commissioned: return "";
    case twin::Outcome::not_enough_movement:
      return "The twin was not written; record the loop again while the set point moves.";
    case twin::Outcome::not_healthy:
      return "A fault is never learned as normal. Repair the valve and record the loop again. If "
             "this friction is acceptable, raise --healthy-limit.";
    case twin::Outcome::not_explained:
      return "report.html shows the remaining error; `loopwarden gap` over shorter stretches "
             "(--from, "
             "--to) locates the cause.";
    case twin::Outcome::not_usable: break;
  }
  return "The twin was not written.";
}

void print_result(const twin::Commissioning& c, const CommissionDetectability& seen_here,
                  const std::string& out, const std::string& assumed) {
  const std::optional<twin::Detectability>& detectability = seen_here.specialists;
  fmt::print("{}: {}\n", twin::to_text(c.outcome), c.why);
  for (const std::string& note : c.notes) fmt::print("  {}\n", note);
  if (!c.stages.empty()) {
    fmt::print("\n{:<36}{:>12}{:>12}\n", "rmse of PV, PV units", "fitted", "held out");
    for (const twin::Stage& stage : c.stages) {
      fmt::print("{:<36}{:>12.4g}{:>12.4g}\n", stage.name, stage.rmse, stage.holdout_rmse);
    }
  }
  if (c.gap && std::isfinite(c.gap->floor.rmse())) {
    fmt::print("{:<36}{:>24.4g}\n", "noise floor", c.gap->floor.rmse());
  }
  if (!seen_here.twin.empty()) fmt::print("\nDetection limits of the twin\n");
  for (const twin::TwinSeen& seen : seen_here.twin) {
    fmt::print("  {:<16} {}\n", to_text(seen.change), seen_text(seen));
  }
  if (detectability) {
    fmt::print(
        "\nDetection limits of the specialists (95 % of the windows with a set-point move as "
        "recorded)\n");
    for (const twin::Seen& seen : detectability->seen) {
      fmt::print("  {:<16} {}\n", specialist::to_text(seen.condition), seen_text(seen));
    }
    fmt::print(
        "False alarms: {} in {:.0f} simulated healthy hours (95 % upper bound: {:.0f} per year)\n",
        detectability->false_alarms, detectability->simulated_years * 8766.0,
        detectability->false_alarms_per_year);
  }
  const fs::path folder = fs::absolute(out).lexically_normal();
  if (c.outcome == twin::Outcome::commissioned) {
    if (!detectability)
      fmt::print("\nNo specialists: they are not available for an integrating process.\n");
    fmt::print("\nFor the loop's file:\nmonitor:\n");
    if (detectability) fmt::print("  specialists: {}\n", (folder / "specialists").string());
    fmt::print("  twin: {}\n", (folder / "twin.yaml").string());
    if (!assumed.empty()) fmt::print("{}\n", assumed);
  } else {
    fmt::print("{}\n", advice(c.outcome));
    if (fs::exists(folder / "twin.yaml")) {
      fmt::print("{}: unchanged, from an earlier run\n", (folder / "twin.yaml").string());
    }
  }
  fmt::print("{0}/commission.json, {0}/report.html\n", out);
}

nlohmann::json changes_json(const std::vector<twin::Change>& changes) {
  nlohmann::json out = nlohmann::json::array();
  for (const twin::Change& change : changes) {
    out.push_back({{"what", change.what}, {"before", change.before}, {"now", change.now}});
  }
  return out;
}

void print_changes(const std::vector<twin::Change>& changes) {
  if (changes.empty()) return;
  fmt::print("{:<40}{:>12}{:>12}{:>10}\n", "Since it was commissioned", "before", "now", "change");
  for (const twin::Change& change : changes) {
    const std::string percent =
        change.before != 0.0
            ? fmt::format("{:+.1f} %", 100.0 * (change.now - change.before) / change.before)
            : std::string("-");
    fmt::print("{:<40}{:>12.4g}{:>12.4g}{:>10}\n", change.what, change.before, change.now, percent);
  }
  fmt::print("\n");
}

// Takes the recorder's records in place of files and keeps them with the result. The longest makes
// the twin.
void take_from_recorder(CommissionOptions& options, OutputFiles& files) {
  const fs::path folder = fs::path(options.out) / "records";
  files.make_folder(folder);
  Recorded recorded = options.recorder.take(options.input.loop(), folder);
  std::stable_sort(recorded.records.begin(), recorded.records.end(),
                   [](const auto& a, const auto& b) { return a.rows > b.rows; });
  for (const Recorded::Record& one : recorded.records) options.records.push_back(one.path);
  options.input = RecordInput();  // its loop is the folder's, not a column's
}

std::pair<double, double> range_of(const char* option, const std::vector<double>& ends) {
  if (!(ends[0] < ends[1])) fail(kExitUsage, "{}: give the lower end first", option);
  return {ends[0], ends[1]};
}

// Returns the daemon's description of the loop; nullopt without a daemon, or if it does not have
// the loop.
std::optional<protocol::LoopDescription> described(const CommissionOptions& options) {
  if (options.input.loop().empty()) return std::nullopt;
  try {
    DaemonClient daemon(options.recorder.socket());
    for (auto& loop : protocol::ask(daemon, protocol::DescribeRequest{}).loops) {
      if (loop.tag == options.input.loop()) return loop;
    }
  } catch (const std::runtime_error&) {
  }
  return std::nullopt;
}

// Returns the given ranges of the loop, or those of the daemon. The daemon refuses a twin with
// other ranges.
analysis::KnownRanges known_ranges(const CommissionOptions& options,
                                   const std::optional<protocol::LoopDescription>& loop) {
  analysis::KnownRanges ranges;
  if (loop) {
    ranges = {.pv = std::pair{loop->pv_range[0], loop->pv_range[1]},
              .co = std::pair{loop->co_range[0], loop->co_range[1]}};
  }
  if (!options.pv_range.empty()) ranges.pv = range_of("--pv-range", options.pv_range);
  if (!options.co_range.empty()) ranges.co = range_of("--co-range", options.co_range);
  return ranges;
}

// Checks the ranges of a given model against those of the loop.
void check_ranges(const std::string& file, const plant::LoopModel& model,
                  const analysis::KnownRanges& known) {
  const auto check = [&](const char* key, const std::optional<std::pair<double, double>>& range,
                         double low, double high) {
    constexpr double kApart = 0.01;  // of the span, as the daemon judges a twin
    if (!range) return;
    const double span = range->second - range->first;
    if (std::abs(low - range->first) <= kApart * span &&
        std::abs(high - range->second) <= kApart * span) {
      return;
    }
    fail(kExitConfiguration, "{}: {} is [{:g}, {:g}], and the loop has [{:g}, {:g}]: correct it",
         file, key, low, high, range->first, range->second);
  };
  const control::PidSettings& pid = model.controller.pid;
  check("transmitter.range", known.pv, model.transmitter.low, model.transmitter.high);
  check("controller.output", known.co, pid.output_low, pid.output_high);
}

// Returns why the daemon would refuse a twin of this record; empty if it would accept it or the
// loop is unknown.
std::string why_no_twin_of(const std::optional<protocol::LoopDescription>& loop, double period_s) {
  constexpr double kApart = 0.01;
  if (!loop || std::abs(period_s - loop->sample_time_s) <= kApart * loop->sample_time_s) return {};
  return fmt::format(
      "{} has a sample each {:g} s, this record one each {:g} s: the daemon refuses "
      "its twin. `--period {:g}` gives the record the loop's samples.",
      loop->tag, loop->sample_time_s, period_s, loop->sample_time_s);
}

// Returns the ranges that were assumed for the twin; empty if they are known.
std::string assumed_text(const twin::Request& request, const plant::LoopModel& twin) {
  if (request.model || (request.ranges.pv && request.ranges.co)) return {};
  const control::PidSettings& pid = twin.controller.pid;
  return fmt::format(
      "The range of PV was taken as {:g} to {:g}, that of CO as {:g} to {:g}. If the loop has "
      "others, the daemon refuses this twin: state them by --pv-range and --co-range, or --loop.",
      twin.transmitter.low, twin.transmitter.high, pid.output_low, pid.output_high);
}

int run_commission(const CommissionOptions& given) {
  CommissionOptions options = given;
  const auto begin = std::chrono::steady_clock::now();
  twin::Request request{.records = {},
                        .model = std::nullopt,
                        .healthy_limit_percent = options.healthy_limit_percent,
                        .accept_short = options.accept_short,
                        .ranges = {}};
  const std::string& start = options.again.empty() ? options.model : options.again;
  if (!start.empty()) request.model = load_model(start);
  const std::optional<plant::LoopModel> before =
      options.again.empty() ? std::nullopt : request.model;
  std::vector<std::string> inputs = options.records;
  if (!start.empty()) inputs.push_back(start);
  const bool recorder = options.recorder.asked(!options.records.empty(), options.input.loop());
  const std::optional<protocol::LoopDescription> loop = described(options);
  request.ranges = known_ranges(options, loop);
  if (request.model) check_ranges(start, *request.model, request.ranges);
  OutputFiles files(inputs);
  const fs::path out(options.out);
  files.make_folder(out);
  if (recorder) take_from_recorder(options, files);
  std::vector<std::string> old_weights;  // of a commissioning before this one
  for (const char* name : {"commission.json", "report.html"}) files.expect(out / name);
  const unsigned jobs = threads(options.jobs);
  const ParallelFor parallel = on_threads(jobs);
  try {
    for (const std::string& path : options.records) {
      request.records.push_back(options.input.read(path).record);
      say_if_long(path, request.records.back().size());
    }
    const std::string refused = why_no_twin_of(loop, request.records.front().period_s);
    if (!refused.empty()) fmt::print(stderr, "{}\n", refused);
    std::optional<Progress> progress(std::in_place, "twin", 100);
    const twin::Commissioning made =
        twin::commission(request, parallel, [&](double share) { progress->update_share(share); });
    progress.reset();
    CommissionDetectability detectability;
    if (made.outcome == twin::Outcome::commissioned) {
      detectability.twin = twin::look_by_twin(made.twin, options.seed, parallel);
    }
    if (made.outcome == twin::Outcome::commissioned && !made.twin.process.integrating()) {
      TrainingJob job;
      job.plant = options.plant;
      job.source = "twin of " + fs::path(options.records.front()).filename().string();
      job.model = made.twin;
      job.signature = false;
      job.team.seed = options.seed;
      job.team.windows = options.windows;
      job.threads = jobs;
      progress.emplace("specialists", 3);
      const TrainingResult trained = train_specialists(job, {});
      progress->update(3);
      files.make_folder(out / "specialists");
      old_weights = config::weight_files(out / "specialists");
      config::write_specialists(trained.folder, out / "specialists",
                                [&](const std::string& name, const std::string& text) {
                                  files.add(out / "specialists" / name, text);
                                });
      progress.emplace("what can be seen", 100);
      detectability.specialists =
          twin::look(made.twin, *trained.folder.team, {.seed = options.seed}, parallel,
                     [&](double share) { progress->update_share(share); });
      progress.reset();
    }
    const double seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    if (made.outcome == twin::Outcome::commissioned) {
      files.add(out / "twin.yaml",
                config::write_model(made.twin, "twin, made by loopwarden commission from " +
                                                   options.records.front() + "\n" + made.why));
    }
    std::vector<twin::Change> changes;
    if (before && made.outcome == twin::Outcome::commissioned) {
      changes = twin::changes(*before, made.twin);
    }
    nlohmann::json answer = commission_json(made, detectability);
    if (before) answer["changes"] = changes_json(changes);
    files.add(out / "report.html",
              commission_page(made, detectability, request.records.front(), seconds));
    files.add(out / "commission.json", answer.dump(2) + "\n");
    files.commit();
    config::remove_weights(out / "specialists", old_weights);
    if (options.recorder.background()) {
      fmt::print("{}: {}\n", base::in_words(twin::to_text(made.outcome)), made.why);
    } else if (options.json) {
      show_json(answer);
    } else {
      print_changes(changes);
      print_result(made, detectability, options.out, assumed_text(request, made.twin));
    }
  } catch (const effects::EffectError& e) {
    fail(kExitConfiguration, "{}: {}", start, e.what());
  }
  return kExitOk;
}

}  // namespace

void add_commission(Program& program) {
  auto [command, o] = program.command(
      "commission",
      "Make a loop's twin and specialists from a healthy record, with their detection limits",
      run_commission);
  command.option("records", o.records,
                 "records of the healthy loop, CSV: time, sp, pv, co, and if known "
                 "mode, stem; 20 to 60 minutes with a few set-point moves. The first makes the "
                 "twin, the others must agree with it");
  o.recorder.add_options(command,
                         "; PV's and CO's range are those of the daemon's loop. The record is "
                         "kept in the folder records of --out");
  Option model =
      command.option("--model", o.model,
                     "loop model to start from, YAML, however rough; without it one is identified");
  command
      .option("--again", o.again,
              "twin.yaml of an earlier commissioning to start from: changes since then are "
              "shown. The file is not changed")
      .excludes(model);
  command.required("--out", o.out,
                   "folder for twin.yaml, specialists, commission.json, report.html");
  command
      .option("--pv-range", o.pv_range,
              "lower and upper end of PV's range, as in the loop's file; without it that of the "
              "daemon's loop of --loop, or assumed from the record")
      .takes(2);
  command.option("--co-range", o.co_range, "the same for CO").takes(2);
  command.setting("--healthy-limit", o.healthy_limit_percent,
                  "friction or backlash of a healthy valve, % of the CO span; above it the verdict "
                  "is not_healthy",
                  between(0.0, 20.0));
  command.flag("--accept-short", o.accept_short,
               "accept less than 20 minutes and, with --model, a record without CO");
  command.setting("--plant", o.plant, "prefix of the names of the specialists");
  command.setting("--seed", o.seed, "seed of all random numbers");
  command.setting("--windows", o.windows, "simulated windows that the specialists learn from",
                  between(700, 1000000));
  command.setting("--jobs", o.jobs, "threads; 0: one per core. The result does not depend on it");
  command.flag("--json", o.json, "print commission.json");
  o.input.add_options(command);
  command.footer(
      "A verdict is a result: exit code 0. Twin and specialists are written only when it is "
      "`commissioned`.\n"
      "Examples: loopwarden commission healthy.csv --model rough.yaml --out commissioned\n"
      "          loopwarden commission healthy.csv --pv-range 0 25 --co-range 0 100 --out "
      "commissioned\n"
      "          loopwarden commission --loop FIC-205 --last 4h --out commissioned");
}

}  // namespace loopwarden::workbench
