// SPDX-License-Identifier: Apache-2.0
// loopwarden-study specialist: prints the tables of lab/results/specialists.md.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "config/specialists/specialist_folder.hpp"
#include "record/record_csv.hpp"
#include "model/control/pid.hpp"
#include "model/watch/specialist_judge.hpp"
#include "model/alarm/verdict_rule.hpp"
#include "workbench/command_line/command_line.hpp"
#include "workbench/files/model_file.hpp"
#include "workbench/files/output_files.hpp"
#include "base/parallel.hpp"
#include "workbench/report/chart.hpp"
#include "workbench/training/specialist_training.hpp"
#include "lab/program/studies.hpp"

namespace loopwarden::lab {
namespace {

namespace fs = std::filesystem;
using specialist::Condition;
using specialist::kWindowSamples;
using specialist::VerdictName;
using specialist::WindowRequest;

constexpr double kDetectionLimit = 5.0;  // % of CO span
constexpr std::array kFaults{Condition::stiction, Condition::backlash, Condition::hysteresis,
                             Condition::low_air_supply};
constexpr std::array kKnown{Condition::no_fault, Condition::stiction, Condition::backlash,
                            Condition::hysteresis, Condition::low_air_supply};

struct StudyOptions {
  std::vector<std::string> parts;
  std::string data = "examples/specialists";
  std::string records = "examples/plant1";
  std::string out;
  std::uint64_t seed = 100000;
  unsigned jobs = 0;
  bool quick = false;
  bool json = false;
};

struct StudiedPlant {
  plant::LoopModel model;
  config::SpecialistFolder specialists;
};

// Number of windows by verdict.
using Tally = std::array<std::size_t, specialist::kVerdicts>;
double percent(std::size_t part, std::size_t of) {
  return of > 0 ? 100.0 * static_cast<double>(part) / static_cast<double>(of) : 0.0;
}
std::size_t sum(const Tally& t) {
  std::size_t total = 0;
  for (const std::size_t n : t) total += n;
  return total;
}
std::size_t faults(const Tally& t) {
  std::size_t total = 0;
  for (std::size_t v = 0; v < t.size(); ++v) {
    if (specialist::names_fault(static_cast<VerdictName>(v))) total += t[v];
  }
  return total;
}
std::size_t of(const Tally& t, Condition c) { return t[static_cast<std::size_t>(c)]; }
std::size_t undecided(const Tally& t) {
  return t[static_cast<std::size_t>(VerdictName::not_enough_movement)];
}

class Study {
 public:
  explicit Study(const StudyOptions& options)
      : options_(options),
        threads_(options.jobs > 0 ? options.jobs
                                  : std::max(1U, std::thread::hardware_concurrency())) {}

  // Returns false after printing an error.
  bool load() {
    for (const char* name : {"plant1", "plant2", "plant3"}) {
      const fs::path folder = fs::path(options_.data) / name;
      plant::LoopModel model = workbench::load_model((folder / "model.yaml").string());
      auto specialists = config::read_specialists(folder);
      fmt::print(stderr, "{}", config::to_text(specialists.diagnostics));
      if (!specialists || !specialists->team) return false;
      plants_.push_back({std::move(model), std::move(*specialists)});
    }
    return true;
  }

  bool wants(const char* part) const {
    return options_.parts.empty() ||
           std::find(options_.parts.begin(), options_.parts.end(), part) != options_.parts.end();
  }

  void begin(const char* part) { part_ = part; }
  const nlohmann::json& all_found() const noexcept { return found_; }

  void table_of_signatures();
  void fresh_signatures();
  void severity_sweep();
  void windows_anywhere();
  void unknown_effects();
  void loop_year();
  void transfer();
  bool real_signatures();

 private:
  std::size_t count(std::size_t full, std::size_t quick) const {
    return options_.quick ? quick : full;
  }
  std::uint64_t seed(std::uint64_t part, std::uint64_t k) const {
    return specialist::stream_seed(options_.seed + part, k);
  }
  // Evaluates `count` windows of this request with the team.
  Tally judge_windows(const specialist::Team& team, const plant::LoopModel& model,
                      const WindowRequest& request, std::size_t number, std::uint64_t part) const;

  // Prints tables for people; with --json the results are printed as JSON instead.
  template <class... Values>
  void say(fmt::format_string<Values...> text, Values&&... values) const {
    if (!options_.json) fmt::print(text, std::forward<Values>(values)...);
  }
  void heading(const char* first) {
    heading_ = first;
    say("{:<24} {:>8} {:>8} {:>8} {:>10} {:>8} {:>8} {:>8} {:>6}\n", first, "no_fault", "stiction",
        "backlash", "hysteresis", "low air", "unknown", "no verdict", "of");
  }
  void row(std::string_view name, const Tally& t) {
    say("{:<24}", name);
    for (std::size_t v = 0; v < t.size(); ++v) {
      say(" {:>{}.1f}", percent(t[v], sum(t)), v == 3 ? 10 : 8);
    }
    say(" {:>6}\n", sum(t));
    nlohmann::json verdicts = nlohmann::json::object();
    for (std::size_t v = 0; v < t.size(); ++v)
      verdicts[to_text(static_cast<VerdictName>(v))] = t[v];
    found({{"table", heading_},
           {"row", name},
           {"windows", sum(t)},
           {"verdicts", std::move(verdicts)}});
  }
  void found(nlohmann::json what) { found_[part_].push_back(std::move(what)); }

  StudyOptions options_;
  unsigned threads_;
  std::string part_;
  std::string heading_;
  nlohmann::json found_ = nlohmann::json::object();
  std::vector<StudiedPlant> plants_;
};

Tally Study::judge_windows(const specialist::Team& team, const plant::LoopModel& model,
                           const WindowRequest& request, std::size_t number,
                           std::uint64_t part) const {
  Tally total{};
  std::mutex mutex;  // guards total
  const std::size_t chunks = 2UL * threads_;
  base::parallel_for(chunks, threads_, [&](std::size_t chunk) {
    specialist::TeamJudge judge(team);
    Tally own{};
    for (std::size_t k = chunk; k < number; k += chunks) {
      const auto window = specialist::simulate_window(model, request, seed(part, k));
      ++own[static_cast<std::size_t>(judge.judge(window.view()).verdict)];
    }
    const std::lock_guard lock(mutex);
    for (std::size_t v = 0; v < own.size(); ++v) total[v] += own[v];
  });
  return total;
}

// Prints tables 8.3 and 9.1 of the thesis.
void Study::table_of_signatures() {
  struct Row {
    std::size_t plant;
    Condition condition;
  };
  constexpr std::array kRows{Row{0, Condition::no_fault},       Row{0, Condition::backlash},
                             Row{0, Condition::low_air_supply}, Row{0, Condition::stiction},
                             Row{0, Condition::hysteresis},     Row{1, Condition::hysteresis},
                             Row{1, Condition::low_air_supply}, Row{2, Condition::stiction},
                             Row{2, Condition::backlash}};
  // Errors of different plants are compared in volts of the thesis's 0-10 V converter.
  const auto volts = [](double pv, const plant::TransmitterParameters& t) {
    return 10.0 * (pv - t.low) / (t.high - t.low);
  };
  std::vector<specialist::SignatureSpecialist> all;
  for (const StudiedPlant& p : plants_) {
    const plant::TransmitterParameters& t = p.model.transmitter;
    for (specialist::SignatureSpecialist s : p.specialists.signatures) {
      s.scaling = {volts(s.scaling.centre, t), 10.0 * s.scaling.half_span / (t.high - t.low)};
      for (double& pv : s.target) pv = volts(pv, t);
      all.push_back(std::move(s));
    }
  }
  std::vector<specialist::SignatureSpecialist> eight;
  for (const auto& s : all) {
    if (!s.name.starts_with("P2L")) eight.push_back(s);
  }
  for (const auto* specialists : {&eight, &all}) {
    say("\nTable 8.3 rebuilt with {} specialists: mean square errors, V^2\n{:<6}",
        specialists->size(), "");
    for (const auto& s : *specialists) say(" {:>9}", s.name);
    say("  verdict\n");
    specialist::SignatureEnsemble ensemble(*specialists);
    std::size_t right = 0;
    std::size_t shown = 0;
    for (const Row& row : kRows) {
      for (std::uint64_t k = 0; k < 3; ++k) {
        specialist::Signature s = specialist::simulate_signature(
            plants_[row.plant].model, row.condition,
            seed(1, 100 * static_cast<std::uint64_t>(row.condition) + 10 * row.plant + k));
        for (double& pv : s.pv) pv = volts(pv, plants_[row.plant].model.transmitter);
        const auto best = ensemble.verdict(s.pv);
        say("P{}{}{}  ", row.plant + 1, "NSBHL"[static_cast<std::size_t>(row.condition)], k + 1);
        for (const double e : ensemble.errors(s.pv)) say(" {:>9.4g}", e);
        const specialist::SignatureSpecialist& named = (*specialists)[best.value_or(0)];
        const bool good = best && named.condition == row.condition;
        say("  {}{}\n", named.name, good ? "" : "  wrong");
        found({{"specialists", specialists->size()},
               {"plant", row.plant + 1},
               {"truth", to_text(row.condition)},
               {"number", k + 1},
               {"errors_v2", ensemble.errors(s.pv)},
               {"named", named.name},
               {"right", good}});
        right += good ? 1U : 0U;
        ++shown;
      }
    }
    say("Table 9.1 with {} specialists: {} of {} faults right\n", specialists->size(), right,
        shown);
  }
}

void Study::fresh_signatures() {
  const StudiedPlant& p = plants_[0];
  const std::size_t number = count(1000, 10);
  say("\nFresh signatures of plant 1, {} of each condition, severities 6 to 16 % of span "
      "(hysteresis 4 to 10 %,\nlow air 1.2 to 2.4 %/s); share of each verdict in %\n",
      number);
  for (const bool explaining : {false, true}) {
    heading(explaining ? "explaining form" : "signature form");
    for (const Condition condition : kKnown) {
      Tally tally{};
      specialist::SignatureEnsemble ensemble(p.specialists.signatures);
      specialist::TeamJudge judge(*p.specialists.team);
      for (std::size_t k = 0; k < number; ++k) {
        const specialist::Signature s = specialist::simulate_signature(
            p.model, condition, seed(2, 100000 * static_cast<std::uint64_t>(condition) + k));
        if (explaining) {
          ++tally[static_cast<std::size_t>(judge.judge({.pv = s.pv, .co = s.co}).verdict)];
        } else if (const auto best = ensemble.verdict(s.pv)) {
          ++tally[static_cast<std::size_t>(p.specialists.signatures[*best].condition)];
        }
      }
      row(to_text(condition), tally);
    }
  }
}

std::string sweep_picture(const std::vector<double>& severities,
                          const std::vector<std::pair<std::string, std::vector<double>>>& curves) {
  workbench::Chart chart{.title = "windows in which it is named",
                         .x_label = "size, % of CO span (low air: %/s)",
                         .y_label = "%",
                         .height = 300.0};
  chart.logarithmic_x = true;
  chart.y_range = workbench::PlotRange{0.0, 102.0};
  std::vector<double> sizes;
  for (const double s : severities) {
    sizes.push_back(std::log10(s));
    chart.x_names.emplace_back(sizes.back(), fmt::format("{:g}", s));
  }
  for (const double p : {0.0, 50.0, 95.0}) chart.y_names.emplace_back(p, fmt::format("{:g}", p));
  for (const auto& [name, shares] : curves) {
    chart.lines.push_back({.name = name,
                           .colour = workbench::chart_colour(chart.lines.size()),
                           .x = sizes,
                           .y = shares});
  }
  return workbench::chart_svg(chart);
}

void Study::severity_sweep() {
  const StudiedPlant& p = plants_[0];
  const std::size_t number = count(300, 4);
  const std::vector<double> sizes{1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0};
  const std::vector<double> noises{0.05, 0.1, 0.2, 0.4};
  say("\nSeverity sweep of plant 1, decided windows with set-point steps, {} each: named correctly "
      "/ called a fault, in %\n",
      number);
  std::vector<std::pair<std::string, std::vector<double>>> curves;
  for (const Condition condition : kFaults) {
    say("{:<16}", to_text(condition));
    for (const double size : sizes) say(" {:>9g}", size);
    say("  {}  found in 95 %\n", condition == Condition::low_air_supply ? "%/s" : "%");
    for (const double noise : noises) {
      say("  noise {:>5g} %  ", noise);
      std::vector<double> called;
      std::vector<double> named;
      for (const double size : sizes) {
        const Tally t = judge_windows(*p.specialists.team, p.model,
                                      {.condition = condition,
                                       .moves = specialist::SetPointMoves::steps,
                                       .severity_percent = size,
                                       .noise_percent = noise},
                                      number, 3);
        const std::size_t decided = sum(t) - undecided(t);
        named.push_back(percent(of(t, condition), decided));
        called.push_back(percent(faults(t), decided));
        say(" {:>4.0f}/{:<4.0f}", named.back(), called.back());
        found({{"fault", to_text(condition)},
               {"noise_percent", noise},
               {"size_percent", size},
               {"named_percent", named.back()},
               {"called_fault_percent", called.back()}});
      }
      // Less air is the larger fault, so the smallest fault is the fastest rate still found.
      std::string smallest = "none";
      const bool low_air = condition == Condition::low_air_supply;
      for (std::size_t i = 0; i < sizes.size(); ++i) {
        const std::size_t k = low_air ? i : sizes.size() - 1 - i;
        if (called[k] < 95.0) break;
        smallest = fmt::format("{:g}", sizes[k]);
      }
      say("  {}\n", smallest);
      if (noise == 0.1) curves.emplace_back(to_text(condition), named);
    }
  }
  if (!options_.out.empty()) {
    workbench::OutputFiles files;
    files.make_folder(options_.out);
    files.add(fs::path(options_.out) / "specialist-severity.svg", sweep_picture(sizes, curves));
    files.commit();
  }
}

void Study::windows_anywhere() {
  const StudiedPlant& p = plants_[0];
  const std::size_t records = count(100, 2);
  constexpr std::size_t kRecordSamples = 18000;  // 30 minutes
  constexpr std::size_t kWindowsOfRecord = 20;
  say("\nWindows that start anywhere in 30-minute records with set-point steps, {} records "
      "of each condition,\nseverity from {:g} % of span; shares in %\n",
      records, kDetectionLimit);
  for (const bool explaining : {false, true}) {
    heading(explaining ? "explaining form" : "signature form");
    Tally all{};
    std::size_t right = 0;
    for (const Condition condition : kKnown) {
      std::vector<Tally> tallies(records);
      base::parallel_for(records, threads_, [&](std::size_t r) {
        const std::uint64_t own = seed(4, 1000 * static_cast<std::uint64_t>(condition) + r);
        const auto run = specialist::simulate_run(p.model,
                                                  {.condition = condition,
                                                   .moves = specialist::SetPointMoves::steps,
                                                   .least_percent = kDetectionLimit},
                                                  own, kRecordSamples);
        specialist::TeamJudge judge(*p.specialists.team);
        specialist::SignatureEnsemble ensemble(p.specialists.signatures);
        for (std::size_t w = 0; w < kWindowsOfRecord; ++w) {
          const std::size_t from =
              specialist::stream_seed(own, w) % (kRecordSamples - kWindowSamples);
          const auto pv = std::span(run.pv).subspan(from, kWindowSamples);
          const auto co = std::span(run.co).subspan(from, kWindowSamples);
          if (explaining) {
            ++tallies[r][static_cast<std::size_t>(judge.judge({.pv = pv, .co = co}).verdict)];
          } else if (const auto best = ensemble.verdict(pv)) {
            ++tallies[r][static_cast<std::size_t>(p.specialists.signatures[*best].condition)];
          }
        }
      });
      Tally tally{};
      for (const Tally& t : tallies) {
        for (std::size_t v = 0; v < t.size(); ++v) tally[v] += t[v];
      }
      row(to_text(condition), tally);
      right += of(tally, condition);
      for (std::size_t v = 0; v < tally.size(); ++v) all[v] += tally[v];
    }
    say("right: {:.1f} % of the decided ones\n", percent(right, sum(all) - undecided(all)));
  }
}

void Study::unknown_effects() {
  const StudiedPlant& p = plants_[0];
  const std::size_t number = count(1000, 5);
  say("\nEffects that are no valve fault, plant 1, {} windows each; shares in %\n", number);
  heading("explaining form");
  Tally all{};
  for (const std::string_view name : specialist::other_names()) {
    const Tally t = judge_windows(*p.specialists.team, p.model,
                                  {.condition = Condition::other, .other = name}, number, 5);
    row(name, t);
    for (std::size_t v = 0; v < t.size(); ++v) all[v] += t[v];
  }
  say("called a valve fault: {:.2f} %\n", percent(faults(all), sum(all)));
}

void Study::loop_year() {
  const StudiedPlant& p = plants_[0];
  const std::size_t days = count(365, 1);
  const auto samples =
      static_cast<std::size_t>((options_.quick ? 7200.0 : 86400.0) / p.model.sample_time_s);
  std::vector<std::size_t> alarms(days);  // alarms of valve faults
  std::vector<std::size_t> unknowns(days);
  std::vector<Tally> tallies(days);
  base::parallel_for(days, threads_, [&](std::size_t day) {
    const auto run = specialist::simulate_run(p.model, {.condition = Condition::no_fault},
                                              seed(6, day), samples);
    specialist::TeamJudge judge(*p.specialists.team);
    alarm::VerdictRule rule;
    std::array<bool, alarm::kValveAlarmCount> on{};
    for (std::size_t k = 0; k + kWindowSamples <= samples; k += kWindowSamples) {
      const auto verdict = judge.judge({.pv = std::span(run.pv).subspan(k, kWindowSamples),
                                        .co = std::span(run.co).subspan(k, kWindowSamples)});
      ++tallies[day][static_cast<std::size_t>(verdict.verdict)];
      const auto& conditions = rule.add(watch::judgement_of(verdict));
      for (std::size_t a = 0; a < on.size(); ++a) {
        const bool unknown = a == alarm::index_of(alarm::AlarmKind::unknown);
        if (conditions[a].on && !on[a]) ++(unknown ? unknowns : alarms)[day];
        on[a] = conditions[a].on;
      }
    }
  });
  Tally all{};
  std::size_t raised = 0;
  std::size_t raised_unknown = 0;
  std::size_t odd_days = 0;
  for (std::size_t day = 0; day < days; ++day) {
    raised += alarms[day];
    raised_unknown += unknowns[day];
    odd_days += unknowns[day] > 0 ? 1U : 0U;
    for (std::size_t v = 0; v < all.size(); ++v) all[v] += tallies[day][v];
  }
  say("\nHealthy operation, {} days of plant 1, each with process, tuning, noise, load and "
      "set points of its own\n",
      days);
  heading("windows");
  row("no_fault", all);
  say("alarms raised by the monitor's rule: {} of a valve fault, {} of `unknown` on {} days\n",
      raised, raised_unknown, odd_days);
  found({{"days", days},
         {"alarms_of_a_valve_fault", raised},
         {"alarms_unknown", raised_unknown},
         {"days_with_unknown", odd_days}});
}

void Study::transfer() {
  const std::size_t number = count(200, 4);
  say("\nTrained on one plant, used on another, {} windows of each condition, severity from "
      "{:g} % of span; named correctly of\nthe decided ones / faults with another name / healthy "
      "called faulty, in %\n{:<10}",
      number, kDetectionLimit, "");
  for (int b = 1; b <= 3; ++b) say(" {:>24}", fmt::format("used on plant {}", b));
  say("\n");
  const auto line = [&](const char* text, auto measure) {
    say("{}\n", text);
    for (std::size_t a = 0; a < plants_.size(); ++a) {
      say("plant {:<4}", a + 1);
      for (std::size_t b = 0; b < plants_.size(); ++b) {
        std::size_t right = 0;
        std::size_t wrong = 0;
        std::size_t false_alarms = 0;
        std::size_t decided = 0;
        std::size_t healthy = 0;
        for (const Condition c : kKnown) {
          const Tally t = measure(a, b, c);
          const std::size_t can = sum(t) - undecided(t);
          decided += can;
          right += of(t, c);
          if (c == Condition::no_fault) {
            healthy += can;
            false_alarms += faults(t);
          } else {
            wrong += faults(t) - of(t, c);
          }
        }
        say(" {:>24}",
            fmt::format("{:.0f} / {:.0f} / {:.0f}", percent(right, decided),
                        percent(wrong, decided - healthy), percent(false_alarms, healthy)));
        found({{"how", text},
               {"trained_on_plant", a + 1},
               {"used_on_plant", b + 1},
               {"right_percent", percent(right, decided)},
               {"wrong_name_percent", percent(wrong, decided - healthy)},
               {"false_alarm_percent", percent(false_alarms, healthy)}});
      }
      say("\n");
    }
  };
  const auto request = [](Condition c) {
    return WindowRequest{.condition = c,
                         .moves = specialist::SetPointMoves::steps,
                         .least_percent = kDetectionLimit};
  };
  line("signature form, on the signatures it is made for; PV in % of the transmitter's range",
       [&](std::size_t a, std::size_t b, Condition c) {
         Tally t{};
         // Converts to the trained plant's units, so that the result does not depend on the unit
         // only.
         const auto& from = plants_[b].model.transmitter;
         const auto& to = plants_[a].model.transmitter;
         specialist::SignatureEnsemble ensemble(plants_[a].specialists.signatures);
         for (std::size_t k = 0; k < number; ++k) {
           specialist::Signature s = specialist::simulate_signature(
               plants_[b].model, c, seed(7, 10000 * static_cast<std::uint64_t>(c) + k));
           for (double& pv : s.pv) {
             pv = to.low + (pv - from.low) / (from.high - from.low) * (to.high - to.low);
           }
           if (const auto best = ensemble.verdict(s.pv)) {
             ++t[static_cast<std::size_t>(plants_[a].specialists.signatures[*best].condition)];
           }
         }
         return t;
       });
  line("explaining form unchanged: the other plant's process is unknown to it",
       [&](std::size_t a, std::size_t b, Condition c) {
         specialist::Team team = *plants_[a].specialists.team;
         // The spans are known from the instrument's plate.
         const specialist::LoopFacts& other = plants_[b].specialists.team->facts;
         specialist::LoopFacts& f = team.facts;
         f.gain *= (other.pv_high - other.pv_low) / (f.pv_high - f.pv_low) *
                   (f.co_high - f.co_low) / (other.co_high - other.co_low);
         f.co_low = other.co_low;
         f.co_high = other.co_high;
         return judge_windows(team, plants_[b].model, request(c), number, 8);
       });
  line(
      "explaining form with the other plant's gain, time constant and dead time, networks "
      "unchanged",
      [&](std::size_t a, std::size_t b, Condition c) {
        specialist::Team team = *plants_[a].specialists.team;
        team.facts = plants_[b].specialists.team->facts;
        return judge_windows(team, plants_[b].model, request(c), number, 8);
      });
}

// Evaluates the five printed signatures. CO was not printed: it is computed from PV by the PI law
// with the published settings.
bool Study::real_signatures() {
  struct Real {
    const char* file;
    Condition condition;
  };
  constexpr std::array kReal{Real{"P1N22", Condition::no_fault}, Real{"P1B22", Condition::backlash},
                             Real{"P1L21", Condition::low_air_supply},
                             Real{"P1S22", Condition::stiction},
                             Real{"P1H16", Condition::hysteresis}};
  const StudiedPlant& p = plants_[0];
  specialist::SignatureEnsemble ensemble(p.specialists.signatures);
  specialist::TeamJudge judge(*p.specialists.team);
  std::size_t right_signature = 0;
  std::size_t right_explaining = 0;
  say("\nThe five measured signatures of plant 1; trained on simulation alone\n{:<7} {:<15} {:<32}"
      " explaining form, CO from the PI law\n",
      "record", "condition", "signature form, lowest error");
  for (const Real& real : kReal) {
    std::vector<double> pv;
    try {
      pv = record::read_record(fs::path(options_.records) / (std::string(real.file) + ".csv")).pv;
    } catch (const record::RecordError& e) {
      fmt::print(stderr, "{}\n", e.what());
      return false;
    }
    if (pv.size() != kWindowSamples) {
      fmt::print(stderr, "{}: {} samples\n", real.file, pv.size());
      return false;
    }
    control::Pid pid(p.model.controller.pid, p.model.sample_time_s);
    constexpr double kStartSetPoint = 5.0;  // L/min, from the start
    pid.initialise(0.0, pv.front(), pv.front());
    std::vector<double> co;
    double out = 0.0;
    for (const double value : pv) {
      out = std::clamp(pid.step(kStartSetPoint, value, out, 0.0), p.model.controller.pid.output_low,
                       p.model.controller.pid.output_high);
      co.push_back(out);
    }
    const std::size_t best = ensemble.verdict(pv).value_or(0);
    const Condition faithful = p.specialists.signatures[best].condition;
    const specialist::WindowVerdict v = judge.judge({.pv = pv, .co = co});
    const bool good =
        static_cast<std::size_t>(v.verdict) == static_cast<std::size_t>(real.condition);
    right_signature += faithful == real.condition ? 1U : 0U;
    right_explaining += good ? 1U : 0U;
    say("{:<7} {:<15} {:<32} {} (p {:.2f}){}\n", real.file, to_text(real.condition),
        fmt::format("{} ({}){}", to_text(faithful), p.specialists.signatures[best].name,
                    faithful == real.condition ? "" : ", wrong"),
        to_text(v.verdict), v.probability, good ? "" : ", wrong");
    found({{"record", real.file},
           {"truth", to_text(real.condition)},
           {"signature_form", to_text(faithful)},
           {"explaining_form", to_text(v.verdict)},
           {"probability", v.probability}});
  }
  say("right: signature form {} of 5, explaining form {} of 5\n", right_signature,
      right_explaining);
  return true;
}

int run_study(const StudyOptions& options) {
  Study study(options);
  if (!study.load()) return kExitConfiguration;
  const auto wants = [&study](const char* part) {
    study.begin(part);
    return study.wants(part);
  };
  if (wants("table")) study.table_of_signatures();
  if (wants("fresh")) study.fresh_signatures();
  if (wants("sweep")) study.severity_sweep();
  if (wants("anywhere")) study.windows_anywhere();
  if (wants("unknown")) study.unknown_effects();
  if (wants("year")) study.loop_year();
  if (wants("transfer")) study.transfer();
  if (wants("real") && !study.real_signatures()) return kExitData;
  if (options.json) fmt::print("{}\n", study.all_found().dump(2));
  return kExitOk;
}

}  // namespace

void add_specialist(CLI::App& app, int& exit_code) {
  const auto o = std::make_shared<StudyOptions>();
  CLI::App* sub =
      app.add_subcommand("specialist", "Print the tables of lab/results/specialists.md");
  sub->add_option("parts", o->parts, "tables to print; default: all")
      ->check(CLI::IsMember(
          {"table", "fresh", "sweep", "anywhere", "unknown", "year", "transfer", "real"}));
  sub->add_option("--data", o->data, "folder of plant1, plant2, plant3")->capture_default_str();
  sub->add_option("--records", o->records, "folder of the measured signatures")
      ->capture_default_str();
  sub->add_option("--out", o->out, "folder for the plot");
  sub->add_option("--seed", o->seed, "seed of all random numbers; training uses others")
      ->capture_default_str();
  sub->add_option("--jobs", o->jobs, "threads; 0: one per core")->capture_default_str();
  sub->add_flag("--quick", o->quick, "use few windows, to check that it runs");
  workbench::add_json_flag(*sub, o->json);
  sub->footer("Example: loopwarden-study specialist unknown year");
  sub->callback([o, &exit_code] { exit_code = run_study(*o); });
}

}  // namespace loopwarden::lab
