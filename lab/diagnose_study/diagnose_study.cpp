// SPDX-License-Identifier: Apache-2.0
// loopwarden-study diagnose: trains the table of `diagnose` on simulated loops, and evaluates
// `diagnose` on other simulated loops or on labelled records.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <numeric>
#include <set>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "record/record_csv.hpp"
#include "model/diagnosis/diagnosis.hpp"
#include "model/diagnosis/features.hpp"
#include "model/diagnosis/limits.hpp"
#include "model/numeric/statistics.hpp"
#include "workbench/command_line/command_line.hpp"
#include "lab/diagnose_study/diagnosis_cases.hpp"
#include "lab/diagnose_study/diagnosis_fit.hpp"
#include "lab/diagnose_study/diagnosis_training.hpp"
#include "lab/diagnose_study/population_test.hpp"
#include "lab/program/labels.hpp"
#include "lab/program/share.hpp"
#include "workbench/files/output_files.hpp"
#include "base/parallel.hpp"
#include "workbench/command_line/progress.hpp"
#include "lab/program/studies.hpp"

namespace loopwarden::lab {
namespace {

using diagnosis::Cause;
using diagnosis::kCauseCount;

struct StudyOptions {
  std::size_t cases = 4000;
  std::uint64_t seed = 1;
  std::string train;                      // table to write
  bool weights = false;                   // print the weights of the decision
  std::vector<std::string> records;       // folders with labels.csv
  std::vector<std::string> gap_examples;  // folders of records with truth.json
  bool compare_too = false;               // compare the records with the simulated loops
  std::string evidence;                   // CSV to write
  std::string save;                       // folder to write cases to
  bool unknown_kind = false;              // withhold the kind of the simulated loops
  std::vector<std::string> without;       // ingredients of the simulated loops
  std::vector<std::string> with;          // those of `without` to add again
  bool json = false;
  unsigned threads = std::max(1U, std::thread::hardware_concurrency());
};

constexpr const char* kEveryIngredient = "all";

struct Judged {
  std::size_t index = 0;
  LabelledFeatures labelled;
  std::string kind;
  std::string detail;
  std::string mover;
  double size = 0.0;  // CO units, true
  diagnosis::Diagnosis diagnosis;
};

numeric::LoopView view_of(const DiagnosisCase& c) {
  return {.period_s = c.sample_time_s, .pv = c.pv, .sp = c.sp, .co = c.co};
}

Ingredients ingredients_of(const StudyOptions& options) {
  Ingredients chosen = all_ingredients();
  const auto set = [&chosen](const std::vector<std::string>& names, bool on) {
    for (const std::string& name : names) {
      if (const auto one = ingredient(name)) chosen.set(static_cast<std::size_t>(*one), on);
      if (name == kEveryIngredient) on ? chosen.set() : chosen.reset();
    }
  };
  set(options.without, false);
  set(options.with, true);
  return chosen;
}

std::vector<Judged> judge_cases(const StudyOptions& options, std::uint64_t seed, const char* what) {
  const Ingredients ingredients = ingredients_of(options);
  std::vector<Judged> judged(options.cases);
  workbench::Progress progress(what, options.cases);
  base::parallel_for(
      options.cases, options.threads,
      [&](std::size_t i) {
        const DiagnosisCase c = diagnosis_case(seed, i, ingredients);
        Judged& j = judged[i];
        j.index = i;
        j.kind = c.kind;
        j.detail = c.detail;
        j.mover = c.mover;
        j.size = c.size;
        j.labelled.cause = c.cause;
        const auto kind = diagnosis::loop_type(c.kind).value_or(diagnosis::LoopType::unknown);
        j.diagnosis = diagnosis::diagnose(
            view_of(c), options.unknown_kind ? diagnosis::LoopType::unknown : kind);
        const diagnosis::Gate gate = j.diagnosis.prepared.gate;
        if (options.compare_too && j.diagnosis.judged()) {
          j.labelled.features =
              diagnosis::find_features(j.diagnosis.prepared, j.diagnosis.evidence);
        }
        j.diagnosis.prepared = {};  // the series need much memory
        j.diagnosis.prepared.gate = gate;
      },
      [&](std::size_t done) { progress.update(done); });
  return judged;
}

constexpr std::size_t kLeastInCell = 100;

// Prints rates by name; cells with few cases are combined as "others".
void print_cells(const std::map<std::string, Share>& cells) {
  Share others;
  for (const auto& [name, rate] : cells) {
    if (rate.of >= kLeastInCell) {
      fmt::print("  {:<28} {}\n", name, rate.text());
    } else {
      others.hits += rate.hits;
      others.of += rate.of;
    }
  }
  if (others.of > 0) fmt::print("  {:<28} {}\n", "others", others.text());
}

void report(const std::vector<Judged>& judged) {
  using diagnosis::DiagnosisVerdict;
  using diagnosis::Grade;
  std::map<std::string, std::map<std::string, std::size_t>> confusion;
  std::map<std::string, Share> false_seen;
  std::map<std::string, Share> false_any;
  std::map<std::string, Share> found;
  std::map<std::string, Share> found_seen;
  Share right, right_decided, undecided, named, false_alarms, false_at_seen, wide_found, wide_seen,
      levels;
  std::array<std::array<double, 2>, 10> reliability{};  // numbers of other and sticky loops in each
                                                        // tenth of p
  std::vector<double> errors;
  std::vector<double> wide_errors;
  Share within;
  for (const Judged& j : judged) {
    const diagnosis::Diagnosis& d = j.diagnosis;
    const bool sticky = j.labelled.cause == Cause::stiction;
    const bool backlash = j.labelled.cause == Cause::backlash;
    const bool called = d.verdict == DiagnosisVerdict::valve_effect;
    ++confusion[to_text(j.labelled.cause)][to_text(d.verdict)];
    if (backlash) continue;  // both answers are acceptable
    const bool open =
        d.verdict == DiagnosisVerdict::cant_tell || d.verdict == DiagnosisVerdict::not_enough_data;
    const bool seen = called && d.grade == Grade::seen;
    right.count(called == sticky);
    undecided.count(d.verdict == DiagnosisVerdict::cant_tell);
    if (!open) right_decided.count(called == sticky);
    if (d.judged()) {
      const auto tenth = std::min<std::size_t>(9, static_cast<std::size_t>(d.probability * 10.0));
      reliability[tenth][sticky ? 1 : 0] += 1.0;
    }
    const std::string cell = j.kind + ", " + j.mover;
    if (!sticky) {
      false_alarms.count(called);
      false_at_seen.count(seen);
      false_seen[cell].count(seen);
      false_any[cell].count(called);
      if (j.kind == "level" && j.mover == "set point") levels.count(seen);
      continue;
    }
    named.count(called);
    found[cell].count(called);
    found_seen[cell].count(seen);
    const bool wide = j.size >= 3.0;
    if (wide) {
      wide_found.count(called);
      wide_seen.count(seen);
    }
    if (!called || d.s <= 0.0) continue;
    errors.push_back(std::abs(d.s / j.size - 1.0));
    within.count(j.size >= d.s_low && j.size <= d.s_high);
    if (wide) wide_errors.push_back(errors.back());
  }
  for (const auto& [truth, verdicts] : confusion) {
    fmt::print("{:<12}", truth == "none" ? "healthy" : truth);
    for (const auto& [verdict, count] : verdicts) fmt::print("  {} {}", verdict, count);
    fmt::print("\n");
  }
  fmt::print("\nsticky or not, right: as answered {}, of the decided {}; can't tell {}\n",
             right.text(), right_decided.text(), undecided.text());
  fmt::print("sticky valves found {}; of 3 % of span or more {}, at 'seen' {}\n", named.text(),
             wide_found.text(), wide_seen.text());
  fmt::print("false alarms {}, at 'seen' {}; levels with moving SP, at 'seen' {}\n",
             false_alarms.text(), false_at_seen.text(), levels.text());
  fmt::print(
      "size of the sticky valves found, relative error: median {:.0f} %, nine in ten below {:.0f} "
      "%; "
      "of 3 % of span or more {:.0f} %; truth within the interval {}\n",
      100.0 * numeric::quantile(errors, 0.5), 100.0 * numeric::quantile(errors, 0.9),
      100.0 * numeric::quantile(wide_errors, 0.5), within.text());
  fmt::print("\nfalse at 'seen', by kind and what moves the loop\n");
  print_cells(false_seen);
  fmt::print("\nfalse at either grade\n");
  print_cells(false_any);
  fmt::print("\nsticky valves found at 'seen'\n");
  print_cells(found_seen);
  fmt::print("\nsticky valves found at either grade\n");
  print_cells(found);
  fmt::print("\nprobability of a valve effect: stated, found where half of the loops are sticky\n");
  std::array<double, 2> all{};
  for (const auto& tenth : reliability) {
    all[0] += tenth[0];
    all[1] += tenth[1];
  }
  for (std::size_t i = 0; i < reliability.size(); ++i) {
    const auto [other, sticky] = reliability[i];
    if (other + sticky == 0.0) continue;
    const double share_sticky = sticky / std::max(all[1], 1.0);
    const double share_other = other / std::max(all[0], 1.0);
    fmt::print("  {:.1f} to {:.1f}  {:5.1f} % of {}\n", 0.1 * static_cast<double>(i),
               0.1 * static_cast<double>(i + 1),
               100.0 * share_sticky / (share_sticky + share_other), other + sticky);
  }
}

nlohmann::json as_json(const Judged& j) {
  return {{"case", j.index},
          {"truth", to_text(j.labelled.cause)},
          {"kind", j.kind},
          {"mover", j.mover},
          {"detail", j.detail},
          {"size", j.size},
          {"verdict", to_text(j.diagnosis.verdict)},
          {"grade", to_text(j.diagnosis.grade)},
          {"cause", to_text(j.diagnosis.cause)},
          {"probability", j.diagnosis.probability}};
}

constexpr const char* kEvidenceColumns =
    "verdict,grade,p,log_odds,share,explained,explained_without,standing,s,s_low,s_high,turns,"
    "travel_scatter,cycle_scatter,turns_by,at_limit,jump,stiction\n";

std::string evidence_row(const diagnosis::Diagnosis& d) {
  const diagnosis::ValveEvidence& e = d.evidence;
  return fmt::format(
      "{},{},{:.4f},{:.2f},{:.2f},{:.3f},{:.3f},{:.3f},{:.4g},{:.4g},{:.4g},{},{:.3f},{:.3f},{},"
      "{:.3f},{:.1f},{:.3f}\n",
      to_text(d.verdict), to_text(d.grade), d.probability, e.log_odds, e.share, e.explained,
      d.band.explained_without, e.standing, d.s, d.s_low, d.s_high, e.reversals.count,
      e.reversals.travel_scatter, e.reversals.cycle_scatter, to_text(e.reversals.by()),
      d.prepared.share_at_limit, e.jump, d.stiction_share);
}

void write_evidence(const std::string& path, const std::vector<Judged>& judged) {
  std::ostringstream file;
  file << "index,cause,kind,mover,detail,size," << kEvidenceColumns;
  for (const Judged& j : judged) {
    file << fmt::format("{},{},{},{},{},{:.4g},", j.index, to_text(j.labelled.cause), j.kind,
                        j.mover, j.detail, j.size)
         << evidence_row(j.diagnosis);
  }
  workbench::write_output(path, file.str());
}

int train_table(const StudyOptions& options) {
  const Ingredients ingredients = ingredients_of(options);
  std::vector<LabelledFeatures> drawn(options.cases);
  std::vector<char> usable(options.cases, 0);
  workbench::Progress progress("simulate", options.cases);
  base::parallel_for(
      options.cases, options.threads,
      [&](std::size_t i) {
        const DiagnosisCase c = diagnosis_case(options.seed, i, ingredients);
        const diagnosis::Diagnosis d = diagnosis::diagnose(view_of(c));
        if (!d.judged()) return;
        drawn[i] = {.features = diagnosis::find_features(d.prepared, d.evidence), .cause = c.cause};
        usable[i] = 1;
      },
      [&](std::size_t done) { progress.update(done); });
  std::vector<LabelledFeatures> cases;
  for (std::size_t i = 0; i < drawn.size(); ++i) {
    if (usable[i] != 0) cases.push_back(drawn[i]);
  }
  const TrainedTable table = train(
      cases, TrainingSettings{}, [&](std::size_t count, const std::function<void(std::size_t)>& f) {
        base::parallel_for(count, options.threads, f);
      });
  workbench::write_output(
      options.train,
      table_text(table, fmt::format("loopwarden-study diagnose --train FILE --cases {} --seed {}",
                                    options.cases, options.seed)));
  fmt::print("{}: {} trees from {} cases\n", options.train, table.trees.size(), cases.size());
  return kExitOk;
}

struct LabelledWindow {
  Label label;
  diagnosis::Diagnosis diagnosis;
};

constexpr double kRidge = 0.3;

std::vector<LabelledWindow> read_windows(const std::vector<std::string>& folders) {
  std::vector<LabelledWindow> windows;
  for (const std::string& folder : folders) {
    for (const Label& label : read_labels(std::filesystem::path(folder) / "labels.csv")) {
      const record::Record r = record::read_record(std::filesystem::path(folder) / label.file);
      windows.push_back({.label = label,
                         .diagnosis = diagnosis::diagnose(
                             {.period_s = r.period_s, .pv = r.pv, .sp = r.sp, .co = r.co})});
    }
  }
  return windows;
}

// Prints the weights of the decision with the greatest likelihood on simulated loops. Sticky and
// other loops have the same total weight.
void print_weights(const std::vector<Judged>& simulated) {
  using Limits = diagnosis::DiagnosisLimits;
  std::array<double, 2> count{};
  const auto counts = [](const Judged& j) {
    return j.labelled.cause != Cause::backlash && j.diagnosis.judged();
  };
  for (const Judged& j : simulated) {
    if (counts(j)) count[j.labelled.cause == Cause::stiction ? 1 : 0] += 1.0;
  }
  std::vector<LogisticRow> rows;
  for (const Judged& j : simulated) {
    if (!counts(j)) continue;
    const diagnosis::ValveEvidence& e = j.diagnosis.evidence;
    const diagnosis::ReversalsBy by = e.reversals.by();
    const bool travel = by == diagnosis::ReversalsBy::travel;
    const bool external =
        by == diagnosis::ReversalsBy::time || by == diagnosis::ReversalsBy::clockwork;
    const bool sticky = j.labelled.cause == Cause::stiction;
    rows.push_back({.x = {std::clamp(e.log_odds, Limits::kLeastNats, Limits::kMostNats),
                          std::min(e.standing, Limits::kMostStanding), travel ? 1.0 : 0.0,
                          external ? 1.0 : 0.0},
                    .positive = sticky,
                    .weight = 1.0 / count[sticky ? 1 : 0]});
  }
  const ValveWeights w = fit_logistic(rows, kRidge);
  fmt::print(
      "kPrior {:.2f}, kPerNat {:.3f}, kPerStanding {:.2f}, kForTravel {:.2f}, "
      "kAgainstTime {:.2f}\n",
      w.base, w.per[0], w.per[1], w.per[2], -w.per[3]);
}

constexpr std::array kNames{"log odds", "share", "standing", "explained"};
using Numbers = std::array<double, kNames.size()>;
Numbers numbers_of(const diagnosis::Diagnosis& d) {
  return {d.evidence.log_odds, d.evidence.share, d.evidence.standing, d.evidence.explained};
}

struct LoopFigures {
  std::string name;
  bool sticky = false;
  std::size_t windows = 0;
  std::size_t windows_right = 0;
  std::size_t windows_decided = 0;
  std::size_t windows_decided_right = 0;
  diagnosis::LoopVerdict verdict{};
  Numbers numbers{};  // means over the windows
  bool found() const { return verdict.verdict == diagnosis::DiagnosisVerdict::valve_effect; }
  double log_loss() const {
    return -std::log(sticky ? verdict.probability : 1.0 - verdict.probability);
  }
  bool right() const { return found() == sticky; }
};

std::vector<LoopFigures> by_loop(const std::vector<LabelledWindow>& windows) {
  std::map<std::string, std::vector<const LabelledWindow*>> grouped;
  for (const LabelledWindow& w : windows) grouped[w.label.loop].push_back(&w);
  std::vector<LoopFigures> loops;
  for (const auto& [name, members] : grouped) {
    LoopFigures f{.name = name, .sticky = members.front()->label.sticky, .windows = members.size()};
    std::vector<diagnosis::Diagnosis> diagnoses;
    for (const LabelledWindow* w : members) {
      const auto verdict = w->diagnosis.verdict;
      const bool right = (verdict == diagnosis::DiagnosisVerdict::valve_effect) == f.sticky;
      const bool decided = verdict != diagnosis::DiagnosisVerdict::cant_tell &&
                           verdict != diagnosis::DiagnosisVerdict::not_enough_data;
      f.windows_right += right ? 1U : 0U;
      f.windows_decided += decided ? 1U : 0U;
      f.windows_decided_right += decided && right ? 1U : 0U;
      const Numbers x = numbers_of(w->diagnosis);
      for (std::size_t i = 0; i < x.size(); ++i) {
        f.numbers[i] += x[i] / static_cast<double>(members.size());
      }
      diagnoses.push_back(w->diagnosis);
    }
    f.verdict = diagnosis::judge_loop(diagnoses);
    loops.push_back(f);
  }
  return loops;
}

void print_share(const char* what, const std::vector<LoopFigures>& loops,
                 std::size_t LoopFigures::*hits, std::size_t LoopFigures::*all) {
  std::size_t hit = 0;
  std::size_t of = 0;
  for (const LoopFigures& f : loops) {
    hit += f.*hits;
    of += f.*all;
  }
  const auto interval = bootstrap(loops.size(), 1, [&](std::span<const std::size_t> drawn) {
    double h = 0.0;
    double a = 0.0;
    for (const std::size_t i : drawn) {
      h += static_cast<double>(loops[i].*hits);
      a += static_cast<double>(loops[i].*all);
    }
    return a > 0.0 ? 100.0 * h / a : 100.0;
  });
  fmt::print("{:<46} {:>3} of {:<3} (95 % interval {:.0f} to {:.0f} %)\n", what, hit, of,
             interval.low, interval.high);
}

// Prints the share of sticky loops among those whose p is within each fifth. All windows of a loop
// count as one loop.
void print_reliability(const std::vector<double>& stated, const std::vector<bool>& sticky) {
  constexpr std::size_t kBins = 5;
  std::array<Share, kBins> found;
  for (std::size_t i = 0; i < stated.size(); ++i) {
    found[std::min(kBins - 1, static_cast<std::size_t>(stated[i] * kBins))].count(sticky[i]);
  }
  for (std::size_t b = 0; b < kBins; ++b) {
    if (found[b].of == 0) continue;
    fmt::print("  {:.1f} to {:.1f}  {:5.1f} % of {}\n", static_cast<double>(b) / kBins,
               static_cast<double>(b + 1) / kBins, found[b].percent(), found[b].of);
  }
}

void print_json(const std::vector<LabelledWindow>& windows) {
  nlohmann::json records = nlohmann::json::array();
  for (const LabelledWindow& w : windows) {
    const diagnosis::Diagnosis& d = w.diagnosis;
    records.push_back({{"record", w.label.file},
                       {"loop", w.label.loop},
                       {"sticky", w.label.sticky},
                       {"verdict", to_text(d.verdict)},
                       {"grade", to_text(d.grade)},
                       {"cause", to_text(d.cause)},
                       {"probability", d.probability}});
  }
  nlohmann::json loops = nlohmann::json::array();
  for (const LoopFigures& f : by_loop(windows)) {
    loops.push_back({{"loop", f.name},
                     {"sticky", f.sticky},
                     {"windows", f.windows},
                     {"windows_right", f.windows_right},
                     {"verdict", to_text(f.verdict.verdict)},
                     {"probability", f.verdict.probability}});
  }
  const nlohmann::json result = {{"records", std::move(records)}, {"loops", std::move(loops)}};
  fmt::print("{}\n", result.dump(2));
}

int judge_records(const StudyOptions& options) {
  const std::vector<LabelledWindow> windows = read_windows(options.records);
  if (!options.evidence.empty()) {
    std::ostringstream file;
    file << "file,loop,sticky," << kEvidenceColumns;
    for (const LabelledWindow& w : windows) {
      file << fmt::format("{},{},{},", w.label.file, w.label.loop, w.label.sticky ? 1 : 0)
           << evidence_row(w.diagnosis);
    }
    workbench::write_output(options.evidence, file.str());
  }
  if (options.json) {
    print_json(windows);
    return kExitOk;
  }
  fmt::print("{:<12} {:<7} {:<6} {:<15} {:<6} {:<11} {:>6} {:>6} {:>6} {:>6}\n", "record", "loop",
             "sticky", "verdict", "grade", "cause", "nats", "share", "stands", "p");
  for (const LabelledWindow& w : windows) {
    const diagnosis::Diagnosis& d = w.diagnosis;
    const bool called = d.verdict == diagnosis::DiagnosisVerdict::valve_effect;
    fmt::print("{:<12} {:<7} {:<6} {:<15} {:<6} {:<11} {:>6.1f} {:>6.2f} {:>6.2f} {:>6.2f}{}\n",
               w.label.file, w.label.loop, w.label.sticky ? "yes" : "no", to_text(d.verdict),
               to_text(d.grade), to_text(d.cause), d.evidence.log_odds, d.evidence.share,
               d.evidence.standing, d.probability, called == w.label.sticky ? "" : "  wrong");
  }
  const std::vector<LoopFigures> loops = by_loop(windows);
  fmt::print("\n");
  for (const LoopFigures& f : loops) {
    fmt::print("loop {:<7} {:<6} {}/{} windows; loop: {} {}p {:.2f}{}\n", f.name,
               f.sticky ? "sticky" : "", f.windows_right, f.windows, to_text(f.verdict.verdict),
               f.verdict.grade == diagnosis::Grade::none
                   ? ""
                   : std::string(to_text(f.verdict.grade)) + " ",
               f.verdict.probability, f.right() ? "" : "  wrong");
  }
  fmt::print("\n");
  print_share("windows right, as answered", loops, &LoopFigures::windows_right,
              &LoopFigures::windows);
  print_share("windows right, of the decided", loops, &LoopFigures::windows_decided_right,
              &LoopFigures::windows_decided);
  std::size_t loops_right = 0;
  Share decided;
  Share found;
  Share accused;
  Share seen;
  Share likely;
  std::vector<double> stated;
  std::vector<bool> sticky;
  for (const LoopFigures& f : loops) {
    loops_right += f.right() ? 1U : 0U;
    if (f.verdict.verdict != diagnosis::DiagnosisVerdict::cant_tell) decided.count(f.right());
    (f.sticky ? found : accused).count(f.found());
    if (f.found()) {
      (f.verdict.grade == diagnosis::Grade::seen ? seen : likely).count(f.sticky);
    }
    stated.push_back(f.verdict.probability);
    sticky.push_back(f.sticky);
  }
  fmt::print("loops right, as answered {} of {}; of the decided {} of {}\n", loops_right,
             loops.size(), decided.hits, decided.of);
  std::vector<std::size_t> all(loops.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  const auto mean_loss = [&loops](std::span<const std::size_t> drawn) {
    double sum = 0.0;
    for (const std::size_t i : drawn) sum += loops[i].log_loss();
    return sum / static_cast<double>(drawn.size());
  };
  const BootstrapInterval loss = bootstrap(loops.size(), 1, mean_loss);
  fmt::print("sticky loops found {}, others accused {}; right of those at seen {}, at likely {}\n",
             found.text(), accused.text(), seen.text(), likely.text());
  fmt::print("log-loss by loop {:.3f} (95 % interval {:.3f} to {:.3f}; a coin 0.693)\n",
             mean_loss(all), loss.low, loss.high);
  fmt::print("\nprobability of a valve effect, stated; sticky loops\n");
  print_reliability(stated, sticky);
  fmt::print("\n");
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    std::vector<double> scores;
    for (const LoopFigures& f : loops) scores.push_back(f.numbers[i]);
    const auto auc = [&](std::span<const std::size_t> drawn) {
      std::vector<double> s;
      const auto positive = std::make_unique<bool[]>(drawn.size());
      for (std::size_t k = 0; k < drawn.size(); ++k) {
        s.push_back(scores[drawn[k]]);
        positive[k] = loops[drawn[k]].sticky;
      }
      return area_under_curve(s, {positive.get(), drawn.size()});
    };
    const BootstrapInterval interval = bootstrap(loops.size(), 2, auc);
    fmt::print("AUC by loop, {:<12} {:.2f} (95 % interval {:.2f} to {:.2f})\n", kNames[i], auc(all),
               interval.low, interval.high);
  }
  return kExitOk;
}

// Prints medians, quartiles and the overlap of the two distributions: twice the share of pairs in
// the rarer order.
double compare_distributions(const char* what, std::vector<double> simulated,
                             std::vector<double> measured) {
  if (simulated.empty() || measured.empty()) return 1.0;
  std::vector<double> scores = simulated;
  scores.insert(scores.end(), measured.begin(), measured.end());
  const auto positive = std::make_unique<bool[]>(scores.size());
  for (std::size_t k = 0; k < scores.size(); ++k) positive[k] = k >= simulated.size();
  const double auc = area_under_curve(scores, {positive.get(), scores.size()});
  fmt::print(
      "{:<22} {:>7.2f} ({:>6.2f} to {:>6.2f})   {:>7.2f} ({:>6.2f} to {:>6.2f})   {:>4.0f} %\n",
      what, numeric::quantile(simulated, 0.5), numeric::quantile(simulated, 0.25),
      numeric::quantile(simulated, 0.75), numeric::quantile(measured, 0.5),
      numeric::quantile(measured, 0.25), numeric::quantile(measured, 0.75),
      200.0 * std::min(auc, 1.0 - auc));
  return 2.0 * std::min(auc, 1.0 - auc);
}

Evidence all_evidence(const diagnosis::Features& features, const diagnosis::Diagnosis& d,
                      const std::string& kind, bool sticky) {
  Evidence e{.numbers = {features.begin(), features.end()},
             .plant = {},
             .loop = {},
             .kind = kind,
             .sticky = sticky};
  const Numbers numbers = numbers_of(d);
  e.numbers.insert(e.numbers.end(), numbers.begin(), numbers.end());
  return e;
}

void print_population_test(const std::string& kind, const std::vector<Evidence>& simulated,
                           const std::vector<Evidence>& measured, unsigned threads) {
  const auto of_kind = [&kind](std::vector<Evidence> all) {
    if (kind != "all") {
      std::erase_if(all, [&kind](const Evidence& e) { return e.kind != kind; });
    }
    return all;
  };
  const PopulationTest test =
      test_population(of_kind(simulated), of_kind(measured),
                      [threads](std::size_t count, const std::function<void(std::size_t)>& f) {
                        base::parallel_for(count, threads, f);
                      });
  if (test.plants.empty()) return;
  fmt::print("{:<12} {:>5} {:>9}   {:.2f} ({:.2f} to {:.2f})   {:>8.2f}   {:>6.3f} {:>6.3f}  ",
             kind, test.loops, test.simulated, test.auc, test.auc_low, test.auc_high,
             test.auc_loops_left_out, test.energy, test.p);
  for (const auto& plant : test.plants) {
    fmt::print(" {} {:.2f} ({})", plant.name, plant.auc, plant.loops);
  }
  fmt::print("\n");
}

void write_all_evidence(const std::string& path, const std::vector<Evidence>& simulated,
                        const std::vector<Evidence>& measured) {
  std::ostringstream file;
  file << "plant,loop,kind,sticky";
  for (std::size_t i = 0; i < diagnosis::kFeatures; ++i) file << ",f" << i;
  file << fmt::format(",{}\n", fmt::join(kNames, ","));
  for (const auto* windows : {&simulated, &measured}) {
    for (const Evidence& e : *windows) {
      file << fmt::format("{},{},{},{},{:.5g}\n", e.plant.empty() ? "simulated" : e.plant, e.loop,
                          e.kind, e.sticky ? 1 : 0, fmt::join(e.numbers, ","));
    }
  }
  workbench::write_output(path, file.str());
}

// Trains a classifier to distinguish the two populations, and computes their distance.
void compare_populations(const std::vector<Judged>& simulated,
                         const std::vector<LabelledWindow>& windows, const StudyOptions& options) {
  std::vector<Evidence> drawn;
  std::vector<Evidence> measured;
  std::set<std::string> kinds;
  for (const Judged& j : simulated) {
    if (j.labelled.cause == Cause::backlash || !j.diagnosis.judged()) continue;
    drawn.push_back(all_evidence(j.labelled.features, j.diagnosis, j.kind,
                                 j.labelled.cause == Cause::stiction));
    drawn.back().loop = fmt::format("{}:{}:{}", j.index, to_text(j.labelled.cause), j.detail);
  }
  for (const LabelledWindow& w : windows) {
    if (!w.diagnosis.judged()) continue;
    // Analysers measure a concentration.
    const std::string kind = w.label.kind == "concentration" ? "analyser" : w.label.kind;
    measured.push_back(
        all_evidence(diagnosis::find_features(w.diagnosis.prepared, w.diagnosis.evidence),
                     w.diagnosis, kind, w.label.sticky));
    measured.back().plant = w.label.plant;
    measured.back().loop = w.label.loop;
    kinds.insert(kind);
  }
  if (!options.evidence.empty()) write_all_evidence(options.evidence, drawn, measured);
  fmt::print("\nall evidence together, each plant judged by trees that have not seen it\n");
  fmt::print("{:<12} {:>5} {:>9}   {:<19}   {:>8}   {:>6} {:>6}   AUC by plant (loops)\n", "kind",
             "loops", "simulated", "AUC (90 % interval)", "by loop", "energy", "p");
  for (const std::string& kind : kinds)
    print_population_test(kind, drawn, measured, options.threads);
  print_population_test("all", drawn, measured, options.threads);
}

int compare(const StudyOptions& options) {
  const std::vector<LabelledWindow> measured = read_windows(options.records);
  const std::vector<Judged> simulated = judge_cases(options, options.seed, "diagnose");
  std::string worst;
  double least = 2.0;
  fmt::print("{:<22} {:<27} {:<27} overlap\n", "", "simulated (quartiles)", "measured (quartiles)");
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    for (const bool sticky : {false, true}) {
      std::vector<double> s;
      std::vector<double> m;
      for (const Judged& j : simulated) {
        if (j.labelled.cause == Cause::backlash || !j.diagnosis.judged() ||
            (j.labelled.cause == Cause::stiction) != sticky)
          continue;
        s.push_back(numbers_of(j.diagnosis)[i]);
      }
      for (const LabelledWindow& w : measured) {
        if (w.diagnosis.judged() && w.label.sticky == sticky)
          m.push_back(numbers_of(w.diagnosis)[i]);
      }
      const std::string name = fmt::format("{}, {}", kNames[i], sticky ? "sticky" : "not");
      const double overlap = compare_distributions(name.c_str(), s, m);
      if (overlap < least) worst = name;
      least = std::min(least, overlap);
    }
  }
  fmt::print("largest disagreement: {}\n", worst);
  compare_populations(simulated, measured, options);
  return kExitOk;
}

struct Truth {
  std::string id;
  std::string effect;
  std::vector<std::string> accept;  // names that are correct
};

std::vector<Truth> truths_of(std::istream& file, const std::filesystem::path& path) {
  try {
    std::vector<Truth> truths;
    for (const nlohmann::json& truth : nlohmann::json::parse(file)) {
      truths.push_back({.id = truth.at("id").get<std::string>(),
                        .effect = truth.at("effect").get<std::string>(),
                        .accept = truth.at("accept").get<std::vector<std::string>>()});
    }
    return truths;
  } catch (const nlohmann::json::exception& e) {
    throw record::RecordError(
        record::RecordError::Kind::data, 0, 0,
        fmt::format("{}: not a list of truths with id, effect and accept ({})", path.string(),
                    e.what()));
  }
}

// Evaluates records from another simulator with known truth: truth.json names the hidden effects of
// DIR/ID/record.csv.
int judge_gap_examples(const StudyOptions& options) {
  constexpr std::array<std::string_view, 3> kValveEffects{"stiction", "backlash", "hysteresis"};
  Share found;
  Share false_alarms;
  Share false_seen;
  fmt::print("{:<6} {:<33} {:<15} {:<7} {:<12} {:>5}\n", "record", "truth", "verdict", "grade",
             "cause", "p");
  for (const std::string& folder : options.gap_examples) {
    const std::filesystem::path path = std::filesystem::path(folder) / "truth.json";
    std::ifstream file(path);
    if (!file) {
      throw record::RecordError(record::RecordError::Kind::io, 0, 0,
                                path.string() + ": can't be read");
    }
    for (const Truth& truth : truths_of(file, path)) {
      const record::Record r =
          record::read_record(std::filesystem::path(folder) / truth.id / "record.csv");
      const diagnosis::Diagnosis d = diagnosis::diagnose({.period_s = r.period_s,
                                                          .pv = r.pv,
                                                          .sp = r.sp,
                                                          .co = r.co,
                                                          .co_low = 0.0,
                                                          .co_high = 10.0});
      const bool sticky =
          std::any_of(truth.accept.begin(), truth.accept.end(), [&](const std::string& name) {
            return std::find(kValveEffects.begin(), kValveEffects.end(), name) !=
                   kValveEffects.end();
          });
      const bool called = d.verdict == diagnosis::DiagnosisVerdict::valve_effect;
      if (sticky) {
        found.count(called);
      } else {
        false_alarms.count(called);
        false_seen.count(d.grade == diagnosis::Grade::seen);
      }
      fmt::print("{:<6} {:<33} {:<15} {:<7} {:<12} {:>5.2f}{}\n", truth.id, truth.effect,
                 to_text(d.verdict), to_text(d.grade), to_text(d.cause), d.probability,
                 called == sticky ? ""
                 : called         ? "  false alarm"
                                  : "  missed");
    }
  }
  fmt::print("\nvalve effects found {} of {}; false alarms {} of {}, at 'seen' {}\n", found.hits,
             found.of, false_alarms.hits, false_alarms.of, false_seen.hits);
  return kExitOk;
}

int save_cases(const StudyOptions& options) {
  workbench::OutputFiles files;
  files.make_folder(options.save);
  const Ingredients ingredients = ingredients_of(options);
  for (std::size_t i = 0; i < options.cases; ++i) {
    const DiagnosisCase c = diagnosis_case(options.seed, i, ingredients);
    record::RecordCsvWriter writer(
        files.stage(std::filesystem::path(options.save) /
                    fmt::format("c{:04}_{}_{}_{}.csv", i, to_text(c.cause), c.kind, c.detail)),
        {.sp = !c.sp.empty(), .stem = false});
    for (std::size_t k = 0; k < c.pv.size(); ++k) {
      record::RecordSample sample{
          .time_s = static_cast<double>(k) * c.sample_time_s, .pv = c.pv[k], .co = c.co[k]};
      if (!c.sp.empty()) sample.sp = c.sp[k];
      writer.add(sample);
    }
    writer.finish();
  }
  files.commit();
  return kExitOk;
}

int run_study(const StudyOptions& options) {
  try {
    if (!options.gap_examples.empty()) return judge_gap_examples(options);
    if (options.compare_too) return compare(options);
    if (!options.records.empty()) return judge_records(options);
    if (!options.save.empty()) return save_cases(options);
    if (!options.train.empty()) return train_table(options);
    const std::vector<Judged> judged = judge_cases(options, options.seed, "diagnose");
    if (!options.evidence.empty()) write_evidence(options.evidence, judged);
    if (options.weights) {
      print_weights(judged);
    } else if (options.json) {
      nlohmann::json cases = nlohmann::json::array();
      for (const Judged& j : judged) cases.push_back(as_json(j));
      fmt::print("{}\n", cases.dump(2));
    } else {
      report(judged);
    }
  } catch (const record::RecordError& e) {
    fmt::print(stderr, "{}\n", e.what());
    return e.kind() == record::RecordError::Kind::io ? kExitIo : kExitData;
  }
  return kExitOk;
}

}  // namespace

void add_diagnose(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<StudyOptions>();
  CLI::App* sub = app.add_subcommand(
      "diagnose", "Measure the accuracy of diagnose on simulated loops or labelled records");
  sub->add_option("--cases", options->cases, "simulated loops")->check(CLI::Range(1, 1000000));
  sub->add_option("--seed", options->seed, "of the simulated loops; training and report need two");
  sub->add_option("--train", options->train, "fit the table to these loops and write it here");
  CLI::Option* records = sub->add_option(
      "--records", options->records,
      "folders of records with labels.csv (file, loop, sticky; plant, kind), instead");
  CLI::Option* compare = sub->add_flag("--compare", options->compare_too,
                                       "compare the evidence of simulated loops and records, also "
                                       "with a classifier that separates them")
                             ->needs(records);
  sub->add_option("--gap-examples", options->gap_examples,
                  "folders with truth.json and the records it names, instead: valve effects found, "
                  "and false alarms if the truth is another effect");
  sub->add_flag("--weights", options->weights,
                "print the weights of the decision that fit the simulated loops best, instead")
      ->excludes(records);
  sub->add_flag("--unknown-kind", options->unknown_kind,
                "withhold the kind of the simulated loops");
  sub->add_option("--evidence", options->evidence,
                  "write the evidence of each loop, CSV; with --compare all of both populations");
  std::vector<std::string> names{kEveryIngredient};
  names.insert(names.end(), kIngredientNames.begin(), kIngredientNames.end());
  sub->add_option(
         "--without", options->without,
         "ingredients to remove from the simulated loops (lab/diagnose_study/ingredients.hpp)")
      ->check(CLI::IsMember(names));
  sub->add_option("--with", options->with, "ingredients to keep with '--without all'")
      ->check(CLI::IsMember(names));
  sub->add_option("--save", options->save, "write the simulated loops into this folder, instead");
  sub->add_option("--threads", options->threads, "at once")->check(CLI::Range(1, 1024));
  workbench::add_json_flag(*sub, options->json)->excludes(compare);
  sub->footer("Example: loopwarden-study diagnose --cases 200 --seed 7");
  sub->callback([options, &exit_code] { exit_code = run_study(*options); });
}

}  // namespace loopwarden::lab
