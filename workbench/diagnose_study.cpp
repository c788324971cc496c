// SPDX-License-Identifier: Apache-2.0
// loopwarden diagnose-study: trains the table of `diagnose` on simulated loops, and measures `diagnose` on
// others, or on labelled records.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "hal/record/record_csv.hpp"
#include "model/diagnosis/diagnosis.hpp"
#include "workbench/diagnosis_cases.hpp"
#include "workbench/diagnosis_training.hpp"
#include "workbench/parallel.hpp"
#include "workbench/progress.hpp"
#include "workbench/subcommands.hpp"

namespace loopwarden::workbench {
namespace {

using diagnosis::Cause;
using diagnosis::kCauseCount;

struct StudyOptions {
  std::size_t cases = 4000;
  std::uint64_t seed = 1;
  std::string train;     // table to write
  std::string records;   // folder with labels.csv
  std::string evidence;  // CSV to write
  std::string save;      // folder to write cases to
  unsigned threads = std::max(1U, std::thread::hardware_concurrency());
};

struct Judged {
  std::size_t index = 0;
  LabelledEvidence labelled;
  std::string kind;
  std::string detail;
  double size = 0.0;  // CO units, true
  bool refused = false;
  diagnosis::CauseProbabilities probabilities{};
  diagnosis::Diagnosis diagnosis;
};

diagnosis::RoutineRecord view_of(const DiagnosisCase& c) {
  return {.pv = c.pv, .co = c.co, .sp = c.sp, .sample_time_s = c.sample_time_s};
}

std::vector<Judged> judge_cases(const StudyOptions& options, std::uint64_t seed, const char* what) {
  std::vector<Judged> judged(options.cases);
  Progress progress(what, options.cases);
  parallel_for(
      options.cases, options.threads,
      [&](std::size_t i) {
        const DiagnosisCase c = diagnosis_case(seed, i);
        Judged& j = judged[i];
        j.index = i;
        j.kind = c.kind;
        j.detail = c.detail;
        j.size = c.size;
        j.labelled.cause = c.cause;
        j.diagnosis = diagnosis::diagnose(view_of(c));
        j.refused = j.diagnosis.verdict == diagnosis::Verdict::not_enough_data;
        j.labelled.evidence = j.diagnosis.findings.evidence;
        j.probabilities = j.diagnosis.probabilities;
        j.diagnosis.prepared = {};
      },
      [&](std::size_t done) { progress.update(done); });
  return judged;
}

double valve_probability(const diagnosis::CauseProbabilities& p) {
  return p[static_cast<std::size_t>(Cause::stiction)] +
         p[static_cast<std::size_t>(Cause::backlash)];
}

bool called_sticky(const diagnosis::Diagnosis& d) {
  return d.verdict == diagnosis::Verdict::valve_effect && d.cause == Cause::stiction;
}

struct Rate {
  std::size_t hits = 0;
  std::size_t all = 0;
  void count(bool hit) {
    hits += hit ? 1U : 0U;
    ++all;
  }
  double percent() const {
    return all > 0 ? 100.0 * static_cast<double>(hits) / static_cast<double>(all) : 0.0;
  }
};

void report(const std::vector<Judged>& judged) {
  std::array<std::array<std::size_t, kCauseCount + 1>, kCauseCount> confusion{};
  std::map<std::string, Rate> by_kind;
  std::array<Rate, 10> reliability;
  for (const Judged& j : judged) {
    const auto truth = static_cast<std::size_t>(j.labelled.cause);
    const bool sticky = j.labelled.cause == Cause::stiction;
    const bool called = called_sticky(j.diagnosis);
    ++confusion[truth][j.refused ? kCauseCount : static_cast<std::size_t>(j.diagnosis.cause)];
    const std::string truth_name = to_text(j.labelled.cause);
    by_kind[truth_name + " (all)"].count(called == sticky);
    by_kind[truth_name + " " + j.kind].count(called == sticky);
    by_kind[truth_name + " / " + j.detail].count(called == sticky);
    const double p = valve_probability(j.probabilities);
    reliability[std::min<std::size_t>(9, static_cast<std::size_t>(p * 10.0))].count(
        sticky || j.labelled.cause == Cause::backlash);
  }
  fmt::print("truth \\ named");
  for (std::size_t c = 0; c < kCauseCount; ++c) {
    fmt::print(" {:>11}", c == 0 ? "healthy" : to_text(static_cast<Cause>(c)));
  }
  fmt::print(" {:>11}\n", "refused");
  for (std::size_t truth = 0; truth < kCauseCount; ++truth) {
    fmt::print("{:<13}", to_text(static_cast<Cause>(truth)));
    for (const std::size_t count : confusion[truth]) fmt::print(" {:>11}", count);
    fmt::print("\n");
  }
  Rate sticky_found;
  Rate false_alarms;
  Rate right;
  for (const Judged& j : judged) {
    if (j.labelled.cause == Cause::backlash) continue;  // neither sticky nor healthy
    const bool sticky = j.labelled.cause == Cause::stiction;
    const bool called = called_sticky(j.diagnosis);
    right.count(called == sticky);
    (sticky ? sticky_found : false_alarms).count(called);
  }
  fmt::print(
      "\nsticky valves named {:.1f} % of {}; false alarms {:.1f} % of {}; right {:.1f} % of {}\n",
      sticky_found.percent(), sticky_found.all, false_alarms.percent(), false_alarms.all,
      right.percent(), right.all);
  std::vector<double> size_errors;
  for (const Judged& j : judged) {
    if (j.labelled.cause != Cause::stiction || !called_sticky(j.diagnosis)) continue;
    size_errors.push_back(std::abs(j.diagnosis.s / j.size - 1.0));
  }
  fmt::print(
      "size of the sticky valves named, relative error: median {:.0f} %, nine in ten below {:.0f} "
      "%\n",
      100.0 * diagnosis::quantile(size_errors, 0.5), 100.0 * diagnosis::quantile(size_errors, 0.9));
  fmt::print("\nsticky or not right, by truth and kind\n");
  for (const auto& [name, rate] : by_kind) {
    fmt::print("  {:<28} {:5.1f} % of {}\n", name, rate.percent(), rate.all);
  }
  fmt::print("\nprobability of a valve effect: stated, found\n");
  for (std::size_t i = 0; i < reliability.size(); ++i) {
    fmt::print("  {:.1f} to {:.1f}  {:5.1f} % of {}\n", 0.1 * static_cast<double>(i),
               0.1 * static_cast<double>(i + 1), reliability[i].percent(), reliability[i].all);
  }
}

void write_evidence(const std::string& path, const std::vector<Judged>& judged) {
  std::ofstream file(path);
  file << "index,cause,kind,detail,p_valve";
  for (const auto name : diagnosis::kEvidenceNames) file << ',' << name;
  file << '\n';
  for (const Judged& j : judged) {
    file << fmt::format("{},{},{},{},{:.4f}", j.index, to_text(j.labelled.cause), j.kind, j.detail,
                        valve_probability(j.probabilities));
    for (const double v : j.labelled.evidence) file << ',' << fmt::format("{:.5g}", v);
    file << '\n';
  }
}

int train_table(const StudyOptions& options) {
  std::vector<LabelledEvidence> drawn(options.cases);
  std::vector<char> usable(options.cases, 0);
  Progress progress("simulate", options.cases);
  parallel_for(
      options.cases, options.threads,
      [&](std::size_t i) {
        const DiagnosisCase c = diagnosis_case(options.seed, i);
        const diagnosis::Prepared prepared = diagnosis::prepare(view_of(c));
        if (!prepared.refusal.empty()) return;
        drawn[i] = {.evidence = diagnosis::find_evidence(prepared).evidence, .cause = c.cause};
        usable[i] = 1;
      },
      [&](std::size_t done) { progress.update(done); });
  std::vector<LabelledEvidence> cases;
  for (std::size_t i = 0; i < drawn.size(); ++i) {
    if (usable[i] != 0) cases.push_back(drawn[i]);
  }
  const TrainedTable table = train(
      cases, TrainingSettings{}, [&](std::size_t count, const std::function<void(std::size_t)>& f) {
        parallel_for(count, options.threads, f);
      });
  std::ofstream file(options.train);
  file << table_source(table,
                       fmt::format("loopwarden diagnose-study --train FILE --cases {} --seed {}",
                                   options.cases, options.seed));
  if (!file.flush()) {
    fmt::print(stderr, "{}: can't be written\n", options.train);
    return kExitIo;
  }
  fmt::print("{}: {} trees from {} cases\n", options.train, table.trees.size(), cases.size());
  return kExitOk;
}

struct Label {
  std::string file;
  std::string loop;
  bool sticky = false;
};

std::vector<Label> read_labels(const std::filesystem::path& path) {
  std::ifstream file(path);
  if (!file) {
    throw hal::record::RecordError(hal::record::RecordError::Kind::io, 0, 0,
                                   path.string() + ": can't be read");
  }
  std::vector<Label> labels;
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::istringstream cells(line);
    Label label;
    std::string sample_time;
    std::string sticky;
    std::getline(cells, label.file, ',');
    std::getline(cells, label.loop, ',');
    std::getline(cells, sample_time, ',');
    std::getline(cells, sticky, ',');
    label.sticky = sticky.starts_with('1');
    if (!label.file.empty()) labels.push_back(label);
  }
  return labels;
}

int judge_records(const StudyOptions& options) {
  const std::filesystem::path folder(options.records);
  Rate windows;
  Rate false_alarms;
  std::map<std::string, Rate> loops;
  fmt::print("{:<12} {:<5} {:<7} {:<15} {:<11} {:>8} {:>9}\n", "record", "loop", "sticky",
             "verdict", "cause", "p(valve)", "period s");
  for (const Label& label : read_labels(folder / "labels.csv")) {
    const hal::record::Record r = hal::record::read_record(folder / label.file);
    const diagnosis::Diagnosis d =
        diagnosis::diagnose({.pv = r.pv, .co = r.co, .sp = r.sp, .sample_time_s = r.period_s});
    const bool called = d.verdict == diagnosis::Verdict::valve_effect && d.cause == Cause::stiction;
    windows.count(called == label.sticky);
    if (!label.sticky) false_alarms.count(called);
    loops[label.loop].count(called == label.sticky);
    fmt::print("{:<12} {:<5} {:<7} {:<15} {:<11} {:>8.3f} {:>9.4g}{}\n", label.file, label.loop,
               label.sticky ? "yes" : "no", to_text(d.verdict), to_text(d.cause),
               valve_probability(d.probabilities), d.period_s,
               called == label.sticky ? "" : "  wrong");
  }
  fmt::print("\nwindows right {:.1f} % of {}, false alarms {:.1f} % of {}\n", windows.percent(),
             windows.all, false_alarms.percent(), false_alarms.all);
  for (const auto& [loop, rate] : loops) fmt::print("loop {}: {}/{}\n", loop, rate.hits, rate.all);
  return kExitOk;
}

int save_cases(const StudyOptions& options) {
  std::filesystem::create_directories(options.save);
  for (std::size_t i = 0; i < options.cases; ++i) {
    const DiagnosisCase c = diagnosis_case(options.seed, i);
    hal::record::RecordCsvWriter writer(
        std::filesystem::path(options.save) /
            fmt::format("c{:04}_{}_{}_{}.csv", i, to_text(c.cause), c.kind, c.detail),
        {.sp = !c.sp.empty(), .stem = false});
    for (std::size_t k = 0; k < c.pv.size(); ++k) {
      hal::record::RecordSample sample{
          .time_s = static_cast<double>(k) * c.sample_time_s, .pv = c.pv[k], .co = c.co[k]};
      if (!c.sp.empty()) sample.sp = c.sp[k];
      writer.add(sample);
    }
    writer.finish();
  }
  return kExitOk;
}

int run_study(const StudyOptions& options) {
  try {
    if (!options.records.empty()) return judge_records(options);
    if (!options.save.empty()) return save_cases(options);
    if (!options.train.empty()) return train_table(options);
    const std::vector<Judged> judged = judge_cases(options, options.seed, "diagnose");
    if (!options.evidence.empty()) write_evidence(options.evidence, judged);
    report(judged);
  } catch (const hal::record::RecordError& e) {
    fmt::print(stderr, "{}\n", e.what());
    return e.kind() == hal::record::RecordError::Kind::io ? kExitIo : kExitData;
  }
  return kExitOk;
}

}  // namespace

void add_diagnose_study(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<StudyOptions>();
  CLI::App* sub = app.add_subcommand(
      "diagnose-study", "how well diagnose does on simulated loops or labelled records");
  sub->add_option("--cases", options->cases, "simulated loops")->check(CLI::Range(1, 1000000));
  sub->add_option("--seed", options->seed, "of the simulated loops; training and report need two");
  sub->add_option("--train", options->train, "fit the table to these loops and write it here");
  sub->add_option("--records", options->records, "folder of records with labels.csv, instead");
  sub->add_option("--evidence", options->evidence, "write the evidence of each loop, CSV");
  sub->add_option("--save", options->save, "write the simulated loops into this folder, instead");
  sub->add_option("--threads", options->threads, "at once")->check(CLI::Range(1, 1024));
  sub->callback([options, &exit_code] { exit_code = run_study(*options); });
}

}  // namespace loopwarden::workbench
