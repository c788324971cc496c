// SPDX-License-Identifier: Apache-2.0
// loopwarden diagnose: what is wrong with a loop, from routine records and no model.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "base/parallel.hpp"
#include "record/record_csv.hpp"
#include "model/analysis/stretch.hpp"
#include "model/diagnosis/archive_rule.hpp"
#include "model/diagnosis/diagnosis.hpp"
#include "model/diagnosis/scales.hpp"
#include "workbench/command_line/frame.hpp"
#include "workbench/report/diagnosis_page.hpp"
#include "workbench/records/record_input.hpp"
#include "workbench/text/diagnose_text.hpp"
#include "workbench/files/output_files.hpp"
#include "workbench/command_line/progress.hpp"
#include "workbench/commands/subcommands.hpp"
#include "workbench/survey/loop_result.hpp"
#include "workbench/survey/neighbours.hpp"

namespace loopwarden::workbench {
namespace {

using diagnosis::LoopKind;

struct DiagnoseOptions {
  RecordInput input;
  std::vector<std::string> records;
  std::vector<std::string> neighbours;
  std::vector<double> co_range{0.0, 100.0};
  std::string kind;
  std::string report;
  bool json = false;
};

// A record of at least two windows of this length is cut.
constexpr std::size_t kLongestWindow = 1500;
constexpr double kWindowMovements = 15.0;  // periods of movement that a window holds at the least
// Of more windows than this the ones that tell most are judged, spread over the record.
constexpr std::size_t kMostWindows = 48;
constexpr std::size_t kMostSamples = 30000;      // of a window: about a second of work
constexpr std::size_t kLookedAt = 60000;         // samples, for the period
constexpr std::size_t kSamplesCompared = 20000;  // of a record, with its neighbours

std::size_t window_length(const record::Record& r) {
  if (r.size() < 2 * kLongestWindow) return r.size();
  const std::size_t looked = std::min(r.size(), kLookedAt);
  const std::size_t from = (r.size() - looked) / 2;
  std::vector<double> pv(r.pv.begin() + static_cast<std::ptrdiff_t>(from),
                         r.pv.begin() + static_cast<std::ptrdiff_t>(from + looked));
  std::vector<double> co(r.co.begin() + static_cast<std::ptrdiff_t>(from),
                         r.co.begin() + static_cast<std::ptrdiff_t>(from + looked));
  for (std::size_t k = 0; k < pv.size(); ++k) {
    if (std::isfinite(pv[k]) && std::isfinite(co[k])) continue;
    pv[k] = k > 0 ? pv[k - 1] : 0.0;
    co[k] = k > 0 ? co[k - 1] : 0.0;
  }
  const double length = std::max(static_cast<double>(kLongestWindow),
                                 kWindowMovements * diagnosis::judged_period(pv, co));
  return static_cast<std::size_t>(
      std::min({length, static_cast<double>(kMostSamples), static_cast<double>(r.size())}));
}

struct Stretch {
  std::size_t from;
  std::size_t size;
};

std::vector<Stretch> stretches_of(const record::Record& r) {
  const std::size_t length = window_length(r);
  const std::size_t count = std::max<std::size_t>(1, r.size() / std::max<std::size_t>(1, length));
  std::vector<Stretch> stretches;
  if (count <= kMostWindows) {
    for (std::size_t w = 0; w < count; ++w) {
      const std::size_t from = r.size() * w / count;
      stretches.push_back({from, r.size() * (w + 1) / count - from});
    }
    return stretches;
  }
  const auto known = [](bool has, const std::vector<double>& column) {
    return has ? std::span<const double>(column) : std::span<const double>();
  };
  for (const std::size_t from : analysis::telling_stretches({.pv = r.pv,
                                .co = r.co,
                                .sp = known(r.has_sp, r.sp),
                                .automatic = known(r.has_mode, r.automatic)},
                                                            length, kMostWindows)) {
    stretches.push_back({from, length});
  }
  fmt::print(stderr, "{} windows of {:.6g} s: of each {} the one in which most moves is judged\n",
             count, static_cast<double>(length) * r.period_s, count / kMostWindows);
  return stretches;
}

void diagnose_record(const std::string& path, record::Imported& imported, LoopKind kind,
                     DiagnosedLoop& loop) {
  record::Record& r = imported.record;
  const std::size_t by_hand = leave_out_manual(r);
  if (by_hand > 0) fmt::print(stderr, "{}: {} samples in manual are left out\n", path, by_hand);
  draw_for_judging(imported);
  const diagnosis::Archived archived{imported.notes.pv, imported.notes.co};
  const std::vector<Stretch> stretches = stretches_of(r);
  const std::span<const double> pv(r.pv);
  const std::span<const double> co(r.co);
  const std::span<const double> sp(r.sp);
  Progress progress("diagnose", stretches.size());
  const std::size_t first = loop.windows.size();
  loop.windows.resize(first + stretches.size());
  base::parallel_for(
      stretches.size(), threads(0),
      [&](std::size_t w) {
        const auto [from, size] = stretches[w];
        DiagnosedWindow& window = loop.windows[first + w];
        window = {
            .file = path,
            .from_s = r.time_s[from],
            .to_s = r.time_s[from + size - 1],
            .period_s = r.period_s,
            .import = loop.imports.size(),
            .diagnosis = diagnosis::diagnose({.pv = pv.subspan(from, size),
                                              .co = co.subspan(from, size),
                                              .sp = r.has_sp ? sp.subspan(from, size) : sp.first(0),
                                              .sample_time_s = r.period_s,
                                              .co_low = loop.co_range[0],
                                              .co_high = loop.co_range[1]},
                                             kind)};
        window.sees_from =
            diagnosis::sees_from(pv.subspan(from, size), co.subspan(from, size), archived);
      },
      [&](std::size_t done) { progress.update(done); });
  loop.imports.push_back(std::move(imported.notes));
}

LoopKind kind_of(const DiagnoseOptions& options, const record::Imported& imported) {
  return options.kind.empty() ? diagnosis::kind_from_tag(imported.notes.tag)
                              : *diagnosis::loop_kind(options.kind);
}

// One verdict of all windows.
void judge_all_windows(DiagnosedLoop& loop) {
  std::vector<diagnosis::Diagnosis*> together;
  for (DiagnosedWindow& w : loop.windows) together.push_back(&w.diagnosis);
  diagnosis::share_turns(together);
  for (DiagnosedWindow& w : loop.windows) {
    const record::ImportNotes& notes = loop.imports[w.import];
    diagnosis::mind_archive(w.diagnosis, {notes.pv, notes.co}, w.sees_from,
                            loop.co_range[1] - loop.co_range[0]);
  }
  std::vector<diagnosis::Diagnosis> windows;
  windows.reserve(loop.windows.size());
  for (const DiagnosedWindow& w : loop.windows) windows.push_back(w.diagnosis);
  loop.verdict = diagnosis::judge_loop(windows);
  const DiagnosedWindow& like = loop.windows[loop.verdict.like];
  const record::ImportNotes& notes = loop.imports[like.import];
  diagnosis::mind_archive(loop.verdict, like.diagnosis, {notes.pv, notes.co}, like.sees_from,
                          loop.co_range[1] - loop.co_range[0]);
}

// The other loops in the neighbours' exports, with what their valves show.
std::vector<TimedLoop> read_neighbours(const DiagnoseOptions& options, const std::string& tag) {
  std::vector<TimedLoop> loops;
  record::Importer importer({options.neighbours.begin(), options.neighbours.end()},
                            options.input.options());
  for (std::size_t k = 0; k < importer.loops().size(); ++k) {
    const record::FoundLoop& found = importer.loops()[k];
    if (found.tag == tag || !found.signals.has(record::Role::pv) ||
        !found.signals.has(record::Role::co)) {
      continue;
    }
    record::Imported imported = importer.read_one(k);
    TimedLoop timed = timed_loop(imported.record, imported.notes, kSamplesCompared);
    DiagnosedLoop judged{.windows = {}, .verdict = {}, .co_range = likely_co_range(imported)};
    diagnose_record(found.tag, imported, kind_of(options, imported), judged);
    judge_all_windows(judged);
    timed.tag = found.tag;
    timed.valve_effect = judged.verdict.verdict == diagnosis::DiagnosisVerdict::valve_effect;
    loops.push_back(std::move(timed));
  }
  return loops;
}

// `records`: those of the loop, each compared by itself.
void name_pushing(const DiagnoseOptions& options, std::vector<TimedLoop> records,
                  DiagnosedLoop& loop) {
  const std::size_t own = records.size();
  for (TimedLoop& other : read_neighbours(options, records.front().tag))
    records.push_back(std::move(other));
  const std::vector<Neighbours> found = find_neighbours(records, threads(0));
  bool compared = false;
  std::vector<PushedBy> pushed;
  for (std::size_t k = own; k < records.size(); ++k) compared = compared || found[k].compared;
  for (std::size_t k = 0; k < own; ++k) {
    for (const PushedBy& by : found[k].pushed_by) {
      if (by.source >= own) pushed.push_back(by);
    }
  }
  if (!compared) {
    fmt::print(stderr,
               "no neighbour has the time base of the record (one period, a clock in both or in "
               "neither and the same first and last time): nothing is compared\n");
    return;
  }
  loop.pushed_by.emplace();
  bool main = false;
  for (const PushedBy& by : pushed) {
    const std::string& tag = records[by.source].tag;
    main = main || by.push.main();
    if (std::find(loop.pushed_by->begin(), loop.pushed_by->end(), tag) == loop.pushed_by->end())
      loop.pushed_by->push_back(tag);
  }
  if (pushed.empty() ||
      !survey::neighbour_is_cause(loop.verdict.verdict, loop.verdict.cause, main)) {
    return;
  }
  loop.verdict.verdict = diagnosis::DiagnosisVerdict::other_cause;
  loop.verdict.cause = diagnosis::Cause::neighbour;
  loop.verdict.reason = follows_text(*loop.pushed_by);
}

int run_diagnose(const DiagnoseOptions& options) {
  if (!(options.co_range[1] > options.co_range[0])) {
    fail(kExitUsage, "--co-range: the upper end must be above the lower one");
  }
  DiagnosedLoop loop;
  loop.co_range = options.co_range;
  std::vector<TimedLoop> compared;
  for (const std::string& path : options.records) {
    record::Imported imported = options.input.read(path);
    if (!imported.record.has_co) {
      fail(kExitData,
           "{}: no column 'co': nothing can be said about a valve without it; signatures of PV "
           "alone are judged by 'loopwarden classify --specialists DIR'",
           path);
    }
    if (!options.neighbours.empty())
      compared.push_back(timed_loop(imported.record, imported.notes, kSamplesCompared));
    diagnose_record(path, imported, kind_of(options, imported), loop);
  }
  judge_all_windows(loop);
  if (!options.neighbours.empty()) name_pushing(options, std::move(compared), loop);
  if (!options.report.empty()) {
    write_output(options.report, diagnosis_page(loop), options.records);
  }
  if (options.json) {
    show_json(diagnosis_json(loop));
  } else {
    fmt::print("{}", diagnosis_text(loop));
  }
  return kExitOk;
}

}  // namespace

void add_diagnose(Program& program) {
  auto [command, o] = program.command(
      "diagnose", "valve effect or other cause, from records and no model", run_diagnose);
  command.required(
      "record", o.records,
      "routine records of one loop in the order of time, CSV: time, pv, co, and sp if known");
  command.option(
      "--kind", o.kind,
      "what the loop controls; else from the file's name where it holds a tag such as FIC101",
      one_of({"flow", "pressure", "level", "temperature", "unknown"}));
  command.option("--neighbours", o.neighbours,
                 "exports of other loops with the same time base: which of them push this one");
  command.option("--co-range", o.co_range, "lower and upper end of CO, default 0 100").takes(2);
  command.option("--report", o.report, "write a page with pictures here, HTML");
  command.flag("--json", o.json, "print the result as JSON");
  o.input.add_options(command);
  command.footer("Example: loopwarden diagnose data/routine/r22.csv --json");
}

}  // namespace loopwarden::workbench
