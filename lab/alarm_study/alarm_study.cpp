// SPDX-License-Identifier: Apache-2.0
// loopwarden-study alarm: measures the delay of alarms and the rate of false alarms, with the
// daemon's monitor, rule and alarms at their defaults.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "config/specialists/specialist_folder.hpp"
#include "model/watch/limits.hpp"
#include "model/watch/loop_monitor.hpp"
#include "model/watch/specialist_judge.hpp"
#include "model/numeric/statistics.hpp"
#include "model/specialist/train/simulated_windows.hpp"
#include "model/specialist/train/team_training.hpp"
#include "workbench/command_line/command_line.hpp"
#include "workbench/files/model_file.hpp"
#include "base/parallel.hpp"
#include "record/record_csv.hpp"
#include "lab/alarm_study/routine_replay.hpp"
#include "lab/program/studies.hpp"

namespace loopwarden::lab {
namespace {

using alarm::AlarmKind;
using alarm::kValveAlarmCount;
using specialist::Condition;

constexpr std::size_t kDayParts = 24;

struct Case {
  Condition condition;
  AlarmKind alarm;
  double severity;  // % of the CO span; for low air supply the fill rate, %/s
};
constexpr std::array kCases{Case{Condition::stiction, AlarmKind::stiction, 2.0},
                            Case{Condition::stiction, AlarmKind::stiction, 5.0},
                            Case{Condition::stiction, AlarmKind::stiction, 10.0},
                            Case{Condition::stiction, AlarmKind::stiction, 20.0},
                            Case{Condition::backlash, AlarmKind::backlash, 2.0},
                            Case{Condition::backlash, AlarmKind::backlash, 5.0},
                            Case{Condition::backlash, AlarmKind::backlash, 10.0},
                            Case{Condition::backlash, AlarmKind::backlash, 20.0},
                            Case{Condition::hysteresis, AlarmKind::hysteresis, 2.0},
                            Case{Condition::hysteresis, AlarmKind::hysteresis, 5.0},
                            Case{Condition::hysteresis, AlarmKind::hysteresis, 10.0},
                            Case{Condition::low_air_supply, AlarmKind::low_air_supply, 4.0},
                            Case{Condition::low_air_supply, AlarmKind::low_air_supply, 2.0},
                            Case{Condition::low_air_supply, AlarmKind::low_air_supply, 1.0}};

struct AlarmStudyOptions {
  std::string specialists = "examples/specialists/plant1";
  std::size_t runs = 60;
  std::size_t windows = 40;
  std::size_t days = 60;
  std::uint64_t seed = 200'000;
  unsigned jobs = 0;
  double missing_percent = 0.0;
  std::vector<std::string> records;  // folders with labels.csv
  bool json = false;
};

// First window of each alarm in a run, from 1; 0: not raised.
using FirstAlarms = std::array<std::size_t, kValveAlarmCount>;

struct Run {
  FirstAlarms first{};
  FirstAlarms raised{};  // number of times that each was raised
  std::size_t windows = 0;
  std::size_t not_judged = 0;
};

// Late cycles in stretches of 1 to kLongestBridge. Their share is given on average.
class LateCycles {
 public:
  LateCycles(double percent, std::uint64_t seed) : random_(seed), percent_(percent) {}
  bool next() {
    if (left_ == 0 && percent_ > 0.0) {
      const double mean_length = 0.5 * static_cast<double>(1 + watch::WatchLimits::kLongestBridge);
      std::bernoulli_distribution begins(0.01 * percent_ / mean_length);
      std::uniform_int_distribution<std::size_t> length(1, watch::WatchLimits::kLongestBridge);
      if (begins(random_)) left_ = length(random_);
    }
    if (left_ == 0) return false;
    --left_;
    return true;
  }

 private:
  std::mt19937_64 random_;
  double percent_;
  std::size_t left_ = 0;
};

Run watch(const specialist::SimulatedWindow& loop, const specialist::Team& team, LateCycles late) {
  watch::SpecialistJudge judge(team);
  watch::LoopMonitor watcher({.sample_time_s = team.facts.period_s,
                              .pv_low = team.facts.pv_low,
                              .pv_high = team.facts.pv_high,
                              .co_low = team.facts.co_low,
                              .co_high = team.facts.co_high},
                             alarm::kAlarmRule, &judge);
  Run run;
  std::array<bool, kValveAlarmCount> on{};
  for (std::size_t k = 0; k < loop.pv.size(); ++k) {
    if (late.next()) continue;
    const watch::MonitorStep step = watcher.add({.period_index = k,
                                                 .sp = loop.sp[k],
                                                 .pv = loop.pv[k],
                                                 .co = loop.co[k],
                                                 .stem = std::nan(""),
                                                 .automatic = true,
                                                 .pv_good = true});
    using Kind = watch::MonitorStep::Kind;
    if (step.kind == Kind::not_fit || step.kind == Kind::judged) ++run.windows;
    if (step.kind == Kind::not_fit) ++run.not_judged;
    if (step.kind != Kind::judged && !step.routine) continue;
    for (std::size_t a = 0; a < on.size(); ++a) {
      if (step.conditions[a].on && !on[a]) {
        ++run.raised[a];
        if (run.first[a] == 0) run.first[a] = run.windows;
      }
      on[a] = step.conditions[a].on;
    }
  }
  return run;
}

double percent(std::size_t part, std::size_t of) {
  return of > 0 ? 100.0 * static_cast<double>(part) / static_cast<double>(of) : 0.0;
}

std::string quantile(const std::vector<std::size_t>& delays, double share) {
  if (delays.empty()) return "-";
  return fmt::format("{:.0f}", numeric::quantile({delays.begin(), delays.end()}, share));
}

class AlarmStudy {
 public:
  AlarmStudy(const AlarmStudyOptions& options, plant::LoopModel model, const specialist::Team& team)
      : options_(options),
        model_(std::move(model)),
        team_(team),
        threads_(options.jobs > 0 ? options.jobs
                                  : std::max(1U, std::thread::hardware_concurrency())) {}

  // Returns all results of delays() and healthy(), for --json.
  nlohmann::json found() const { return found_; }

  void delays() {
    if (!options_.json) print_heading();
    for (std::size_t c = 0; c < kCases.size(); ++c) row(c);
  }
  void healthy() {
    // Each part of a day has a different loop, which also keeps memory small.
    const std::size_t parts = kDayParts * options_.days;
    const auto samples = static_cast<std::size_t>(86400.0 / kDayParts / model_.sample_time_s);
    std::vector<Run> runs(parts);
    base::parallel_for(parts, threads_, [&](std::size_t k) {
      runs[k] =
          watch(specialist::simulate_run(model_, {.condition = Condition::no_fault},
                                         specialist::stream_seed(options_.seed + 1000, k), samples),
                team_, {options_.missing_percent, k});
    });
    std::array<std::size_t, kValveAlarmCount> raised{};
    std::size_t windows = 0;
    for (const Run& run : runs) {
      windows += run.windows;
      for (std::size_t a = 0; a < raised.size(); ++a) raised[a] += run.raised[a];
    }
    if (options_.json) {
      nlohmann::json alarms = nlohmann::json::object();
      for (const AlarmKind kind : alarm::kValveAlarms) {
        alarms[to_text(kind)] = raised[alarm::index_of(kind)];
      }
      found_["healthy"] = {
          {"days", options_.days}, {"windows", windows}, {"false_alarms", std::move(alarms)}};
      return;
    }
    const double years = static_cast<double>(options_.days) / 365.0;
    fmt::print(
        "\nHealthy loops, {} days in all ({} windows): false alarms, and that per loop-year\n",
        options_.days, windows);
    for (const AlarmKind kind : alarm::kValveAlarms) {
      const std::size_t n = raised[alarm::index_of(kind)];
      fmt::print("{:<16} {:>6} {:>10.1f}\n", to_text(kind), n, static_cast<double>(n) / years);
    }
  }

 private:
  void print_heading() const {
    const watch::WindowSettings cut;
    const auto advance = static_cast<double>(specialist::kWindowSamples) * (1.0 - cut.overlap);
    fmt::print(
        "Detection: {} loops of each kind, process, tuning, noise, load and set points drawn; the "
        "fault is there from\nthe start; watched for {} windows of {:.0f} s, one each {:.0f} s. "
        "Delay in windows; the rule needs 3 of 5, so 3 is the\nleast.\n\n",
        options_.runs, options_.windows,
        static_cast<double>(specialist::kWindowSamples) * team_.facts.period_s,
        advance * team_.facts.period_s);
    fmt::print("{:<16} {:>10} {:>8} {:>8} {:>8} {:>8} {:>14} {:>10} {:>11}\n", "fault", "severity",
               "named %", "delay", "delay", "delay", "other fault %", "unknown %", "can't tell %");
    fmt::print("{:<16} {:>10} {:>8} {:>8} {:>8} {:>8} {:>14} {:>10} {:>11}\n", "", "", "", "10 %",
               "median", "90 %", "", "", "of windows");
  }

  void row(std::size_t index) {
    const Case& wanted = kCases[index];
    const std::size_t own = alarm::index_of(wanted.alarm);
    const std::size_t unknown = alarm::index_of(AlarmKind::unknown);
    const std::size_t samples =
        // successive windows overlap by half
        specialist::kWindowSamples * (options_.windows + 2) / 2;
    std::vector<Run> runs(options_.runs);
    base::parallel_for(options_.runs, threads_, [&](std::size_t k) {
      runs[k] =
          watch(specialist::simulate_run(
                    model_, {.condition = wanted.condition, .severity_percent = wanted.severity},
                    specialist::stream_seed(options_.seed + index, k), samples),
                team_, {options_.missing_percent, k});
    });
    std::vector<std::size_t> delays;
    std::size_t others = 0;
    std::size_t unknowns = 0;
    std::size_t windows = 0;
    std::size_t not_judged = 0;
    for (const Run& run : runs) {
      if (run.first[own] > 0) delays.push_back(run.first[own]);
      bool other = false;
      for (std::size_t a = 0; a < kValveAlarmCount; ++a) {
        other = other || (a != own && a != unknown && run.first[a] > 0);
      }
      others += other ? 1U : 0U;
      unknowns += run.first[unknown] > 0 ? 1U : 0U;
      windows += run.windows;
      not_judged += run.not_judged;
    }
    if (options_.json) {
      found_["detection"].push_back({{"fault", to_text(wanted.alarm)},
                                     {"severity", wanted.severity},
                                     {"loops", runs.size()},
                                     {"delay_windows", delays},
                                     {"other_fault", others},
                                     {"unknown", unknowns},
                                     {"windows", windows},
                                     {"not_judged", not_judged}});
      return;
    }
    fmt::print("{:<16} {:>10} {:>8.1f} {:>8} {:>8} {:>8} {:>14.1f} {:>10.1f} {:>11.1f}\n",
               to_text(wanted.alarm),
               fmt::format("{:g} {}", wanted.severity,
                           wanted.condition == Condition::low_air_supply ? "%/s" : "%"),
               percent(delays.size(), runs.size()), quantile(delays, 0.1), quantile(delays, 0.5),
               quantile(delays, 0.9), percent(others, runs.size()), percent(unknowns, runs.size()),
               percent(not_judged, windows));
  }

  AlarmStudyOptions options_;
  plant::LoopModel model_;
  const specialist::Team& team_;
  unsigned threads_;
  nlohmann::json found_ = nlohmann::json::object();
};

int run_replay(const AlarmStudyOptions& options) {
  try {
    const nlohmann::json loops = replay_loops(options.records);
    if (options.json) {
      fmt::print("{}\n", loops.dump(2));
    } else {
      print_loops(loops);
    }
  } catch (const record::RecordError& e) {
    fmt::print(stderr, "{}\n", e.what());
    return e.kind() == record::RecordError::Kind::io ? kExitIo : kExitData;
  }
  return kExitOk;
}

int run_alarm_study(const AlarmStudyOptions& options) {
  if (!options.records.empty()) return run_replay(options);
  const plant::LoopModel model =
      workbench::load_model((std::filesystem::path(options.specialists) / "model.yaml").string());
  const auto loaded = config::read_specialists(options.specialists);
  fmt::print(stderr, "{}", config::to_text(loaded.diagnostics));
  if (!loaded || !loaded->team) return kExitConfiguration;
  AlarmStudy study(options, model, *loaded->team);
  if (options.runs > 0) study.delays();
  if (options.days > 0) study.healthy();
  if (options.json) fmt::print("{}\n", study.found().dump(2));
  return kExitOk;
}

}  // namespace

void add_alarm(CLI::App& app, int& exit_code) {
  const auto o = std::make_shared<AlarmStudyOptions>();
  CLI::App* sub =
      app.add_subcommand("alarm", "Measure the delay of alarms and the rate of false alarms");
  sub->add_option("--specialists", o->specialists, "folder with manifest.yaml and model.yaml")
      ->capture_default_str();
  sub->add_option("--runs", o->runs, "loops of each fault and severity; 0: skip this table")
      ->capture_default_str();
  sub->add_option("--windows", o->windows, "windows per loop")
      ->check(CLI::Range(3, 1000))
      ->capture_default_str();
  sub->add_option("--days", o->days, "of healthy operation; 0: skip this part")
      ->capture_default_str();
  sub->add_option("--seed", o->seed, "seed of all random numbers; training uses others")
      ->capture_default_str();
  sub->add_option("--missing", o->missing_percent,
                  "share of late cycles, in stretches of 1 to 4, %")
      ->check(CLI::Range(0.0, 50.0))
      ->capture_default_str();
  sub->add_option("--records", o->records,
                  "folders of records with labels.csv (file, loop, sticky), replayed instead, to "
                  "list the alarms of routine evidence")
      ->type_name("DIR");
  sub->add_option("--jobs", o->jobs, "threads; 0: one per core")->capture_default_str();
  workbench::add_json_flag(*sub, o->json);
  sub->footer("Example: loopwarden-study alarm --days 365");
  sub->callback([o, &exit_code] { exit_code = run_alarm_study(*o); });
}

}  // namespace loopwarden::lab
