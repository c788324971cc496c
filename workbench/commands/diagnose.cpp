// SPDX-License-Identifier: Apache-2.0
// loopwarden diagnose: finds the cause of a loop's trouble from routine records, without a model.
#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "base/parallel.hpp"
#include "record/record_csv.hpp"
#include "model/analysis/stretch.hpp"
#include "model/diagnosis/archive_rule.hpp"
#include "model/diagnosis/diagnosis.hpp"
#include "workbench/command_line/frame.hpp"
#include "workbench/report/diagnosis_page.hpp"
#include "workbench/records/record_input.hpp"
#include "workbench/records/recorder_input.hpp"
#include "workbench/text/diagnose_text.hpp"
#include "workbench/files/output_files.hpp"
#include "workbench/command_line/progress.hpp"
#include "workbench/commands/subcommands.hpp"
#include "workbench/survey/judged_windows.hpp"
#include "workbench/survey/loop_result.hpp"
#include "workbench/survey/neighbours.hpp"

namespace loopwarden::workbench {
namespace {

using diagnosis::LoopType;

struct DiagnoseOptions {
  RecordInput input;
  RecorderInput recorder;  // in place of records
  std::vector<std::string> records;
  std::vector<std::string> neighbours;
  std::vector<double> co_range{};  // empty: 0 to 100, or of the daemon's loop
  std::string kind;
  std::string master;
  std::string report;
  bool json = false;
};

// If there are more stretches than this, the most informative ones are judged, spread over the
// record.
constexpr std::size_t kMostWindows = 48;
constexpr std::size_t kSamplesCompared = 20000;  // of a record, with its neighbours

std::vector<Stretch> judged_stretches(const record::Record& r) {
  std::vector<Stretch> stretches = stretches_of(r);
  const std::size_t count = stretches.size();
  if (count <= kMostWindows) return stretches;
  const std::size_t length = stretches.front().size;
  stretches.clear();
  for (const std::size_t from : analysis::telling_stretches(r.view(), length, kMostWindows)) {
    stretches.push_back({from, length});
  }
  fmt::print(
      stderr,
      "{} windows of {:.6g} s: in each group of {}, the window with the most movement is judged\n",
      count, static_cast<double>(length) * r.period_s, count / kMostWindows);
  return stretches;
}

void diagnose_record(const std::string& path, record::Imported& imported, LoopType kind,
                     DiagnosedLoop& loop) {
  record::Record& r = imported.record;
  const std::size_t by_hand = leave_out_manual(r);
  if (by_hand > 0) fmt::print(stderr, "{}: {} samples in manual are left out\n", path, by_hand);
  draw_for_judging(imported);
  const diagnosis::Archived archived{imported.notes.pv, imported.notes.co};
  const std::vector<Stretch> stretches = judged_stretches(r);
  Progress progress("diagnose", stretches.size());
  const std::size_t first = loop.windows.size();
  loop.windows.resize(first + stretches.size());
  base::parallel_for(
      stretches.size(), threads(0),
      [&](std::size_t w) {
        DiagnosedWindow& window = loop.windows[first + w];
        window = judge_stretch(r, stretches[w], kind, loop.co_range, archived);
        window.file = path;
        window.import = loop.imports.size();
      },
      [&](std::size_t done) { progress.update(done); });
  loop.imports.push_back(std::move(imported.notes));
}

LoopType loop_type_of(const DiagnoseOptions& options, const record::Imported& imported) {
  return options.kind.empty() ? diagnosis::loop_type_from_tag(imported.notes.tag)
                              : *diagnosis::loop_type(options.kind);
}

// Reads the other loops in the neighbours' exports and judges their valves.
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
    diagnose_record(found.tag, imported, loop_type_of(options, imported), judged);
    judge_together(judged);
    timed.tag = found.tag;
    timed.valve_effect = judged.verdict.verdict == diagnosis::DiagnosisVerdict::valve_effect;
    loops.push_back(std::move(timed));
  }
  return loops;
}

// `records`: the loop's records, each compared separately.
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
               "neither and the same first and last time): no comparison is possible\n");
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
      !diagnosis::neighbour_is_cause(loop.verdict.verdict, loop.verdict.cause, main)) {
    return;
  }
  loop.verdict.verdict = diagnosis::DiagnosisVerdict::other_cause;
  loop.verdict.cause = diagnosis::Cause::neighbour;
  loop.verdict.testable = false;
  loop.verdict.reason = follows_text(*loop.pushed_by);
}

// Exports the loop's last hours, under the names of `loopwarden export`.
void diagnose_recorded(const DiagnoseOptions& options, DiagnosedLoop& loop) {
  const std::string& tag = options.input.loop();
  OutputFiles scratch;
  const std::filesystem::path folder = scratch.make_scratch_folder();
  const auto place = [&](const std::filesystem::path& path) { return scratch.stage(path); };
  const Recorded recorded = options.recorder.take(tag, folder, place);
  if (options.co_range.empty())
    loop.co_range.assign(recorded.loop.co_range.begin(), recorded.loop.co_range.end());
  loop.master = recorded.loop.master;
  for (const Recorded::Record& one : recorded.records) {
    record::Imported imported = RecordInput().read(scratch.stage(one.path));
    imported.notes.tag = tag;
    diagnose_record(std::filesystem::path(one.path).filename(), imported,
                    loop_type_of(options, imported), loop);
  }
}

int run_diagnose(const DiagnoseOptions& options) {
  if (!options.co_range.empty() && !(options.co_range[1] > options.co_range[0])) {
    fail(kExitUsage, "--co-range: the upper end must be above the lower one");
  }
  DiagnosedLoop loop;
  loop.co_range = options.co_range.empty() ? std::vector<double>{0.0, 100.0} : options.co_range;
  loop.master = options.master;
  std::vector<TimedLoop> compared;
  if (options.recorder.asked(!options.records.empty(), options.input.loop())) {
    if (!options.neighbours.empty()) fail(kExitUsage, "--neighbours: only with files");
    diagnose_recorded(options, loop);
  }
  for (const std::string& path : options.records) {
    record::Imported imported = options.input.read(path);
    if (imported.record.co.empty()) {
      fail(kExitData,
           "{}: no column 'co', which a judgement of the valve needs; signatures of PV "
           "alone are judged by 'loopwarden classify --specialists DIR'",
           path);
    }
    if (!options.neighbours.empty())
      compared.push_back(timed_loop(imported.record, imported.notes, kSamplesCompared));
    diagnose_record(path, imported, loop_type_of(options, imported), loop);
  }
  judge_together(loop);
  if (!options.neighbours.empty()) name_pushing(options, std::move(compared), loop);
  plan_test(loop);
  if (!options.report.empty()) {
    write_output(options.report, diagnosis_page(loop), options.records);
  }
  if (options.json) {
    show_json(diagnosis_json(loop));
  } else {
    const std::string text = diagnosis_text(loop);
    // In the background, prints only the first line: the verdict.
    fmt::print("{}", options.recorder.background() ? text.substr(0, text.find('\n') + 1) : text);
  }
  return kExitOk;
}

}  // namespace

void add_diagnose(Program& program) {
  auto [command, o] = program.command(
      "diagnose", "Find a valve effect or another cause from records, without a model",
      run_diagnose);
  command.option(
      "record", o.records,
      "routine records of one loop in the order of time, CSV: time, pv, co, and sp if known");
  o.recorder.add_options(command, "; CO's range is that of the daemon's loop");
  command.option("--kind", o.kind,
                 "what the loop controls; default: from a tag such as FIC101 in the file's name",
                 one_of({"flow", "pressure", "level", "temperature", "unknown"}));
  command.option("--master", o.master,
                 "tag of the loop that writes the set point; default: cascade.master of the "
                 "daemon's loop");
  command.option("--neighbours", o.neighbours,
                 "exports of other loops with the same time base: finds those that disturb this "
                 "one; only with files");
  command.option("--co-range", o.co_range, "lower and upper end of CO, default 0 100").takes(2);
  command.option("--report", o.report, "write a page with pictures here, HTML");
  command.flag("--json", o.json, "print the result as JSON");
  o.input.add_options(command);
  command.footer(
      "Examples: loopwarden diagnose examples/routine/r22.csv --json\n"
      "          loopwarden diagnose --loop FIC-205 --last 8h");
}

}  // namespace loopwarden::workbench
