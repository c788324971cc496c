// SPDX-License-Identifier: Apache-2.0
// loopwarden diagnose: what is wrong with a loop, from routine records and no model.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "record/record_csv.hpp"
#include "model/diagnosis/diagnosis.hpp"
#include "model/diagnosis/scales.hpp"
#include "workbench/report/diagnosis_page.hpp"
#include "workbench/records/record_input.hpp"
#include "workbench/text/diagnose_text.hpp"
#include "workbench/files/output_files.hpp"
#include "workbench/command_line/progress.hpp"
#include "workbench/commands/subcommands.hpp"

namespace loopwarden::workbench {
namespace {

using diagnosis::LoopKind;

struct DiagnoseOptions {
  RecordInput input;
  std::vector<std::string> records;
  std::vector<double> co_range{0.0, 100.0};
  std::string kind;
  std::string report;
  bool json = false;
};

// A record of at least two windows of this length is cut.
constexpr std::size_t kLongestWindow = 1500;
constexpr double kWindowMovements = 15.0;  // periods of movement that a window holds at the least

std::size_t windows_in(const record::Record& r) {
  if (r.size() < 2 * kLongestWindow) return 1;
  std::vector<double> pv = r.pv;
  std::vector<double> co = r.co;
  for (std::size_t k = 0; k < pv.size(); ++k) {
    if (std::isfinite(pv[k]) && std::isfinite(co[k])) continue;
    pv[k] = k > 0 ? pv[k - 1] : 0.0;
    co[k] = k > 0 ? co[k - 1] : 0.0;
  }
  const double length = std::max(static_cast<double>(kLongestWindow),
                                 kWindowMovements * diagnosis::movement_period(co, pv));
  return std::max<std::size_t>(1, static_cast<std::size_t>(static_cast<double>(r.size()) / length));
}

void diagnose_record(const std::string& path, const record::Record& r, LoopKind kind,
                     DiagnosedLoop& loop) {
  const std::size_t count = windows_in(r);
  const std::span<const double> pv(r.pv);
  const std::span<const double> co(r.co);
  const std::span<const double> sp(r.sp);
  for (std::size_t w = 0; w < count; ++w) {
    const std::size_t from = r.size() * w / count;
    const std::size_t size = r.size() * (w + 1) / count - from;
    loop.windows.push_back(
        {.file = path,
         .from_s = r.time_s[from],
         .to_s = r.time_s[from + size - 1],
         .period_s = r.period_s,
         .diagnosis = diagnosis::diagnose({.pv = pv.subspan(from, size),
                                           .co = co.subspan(from, size),
                                           .sp = r.has_sp ? sp.subspan(from, size) : sp.first(0),
                                           .sample_time_s = r.period_s,
                                           .co_low = loop.co_range[0],
                                           .co_high = loop.co_range[1]},
                                          kind)});
  }
}

int run_diagnose(const DiagnoseOptions& options) {
  if (!(options.co_range[1] > options.co_range[0])) {
    fmt::print(stderr, "--co-range: the upper end must be above the lower one\n");
    return kExitUsage;
  }
  DiagnosedLoop loop;
  loop.co_range = options.co_range;
  try {
    for (const std::string& path : options.records) {
      const record::Imported imported = options.input.read(path);
      const record::Record& r = imported.record;
      if (!r.has_co) {
        fmt::print(stderr,
                   "{}: no column 'co': nothing can be said about a valve without it; signatures "
                   "of PV alone are "
                   "judged by 'loopwarden classify --specialists DIR'\n",
                   path);
        return kExitData;
      }
      say_if_long(path, r.size());
      const LoopKind kind =
          options.kind.empty()
              ? diagnosis::kind_from_tag(std::filesystem::path(path).stem().string())
              : *diagnosis::loop_kind(options.kind);
      diagnose_record(path, r, kind, loop);
    }
  } catch (const record::RecordError& e) {
    fmt::print(stderr, "{}\n", e.what());
    return e.kind() == record::RecordError::Kind::io ? kExitIo : kExitData;
  }
  std::vector<diagnosis::Diagnosis> windows;
  windows.reserve(loop.windows.size());
  for (const DiagnosedWindow& w : loop.windows) windows.push_back(w.diagnosis);
  loop.verdict = diagnosis::judge_loop(windows);
  if (!options.report.empty()) {
    write_output(options.report, diagnosis_page(loop), options.records);
  }
  if (options.json) {
    fmt::print("{}\n", diagnosis_json(loop).dump(2));
  } else {
    fmt::print("{}", diagnosis_text(loop));
  }
  return kExitOk;
}

}  // namespace

void add_diagnose(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<DiagnoseOptions>();
  CLI::App* sub =
      app.add_subcommand("diagnose", "valve effect or other cause, from records and no model");
  sub->add_option(
         "record", options->records,
         "routine records of one loop in the order of time, CSV: time, pv, co, and sp if known")
      ->required();
  sub->add_option(
         "--kind", options->kind,
         "what the loop controls; else from the file's name where it holds a tag such as FIC101")
      ->check(CLI::IsMember({"flow", "pressure", "level", "temperature", "unknown"}));
  sub->add_option("--co-range", options->co_range, "lower and upper end of CO, default 0 100")
      ->expected(2);
  sub->add_option("--report", options->report, "write a page with pictures here, HTML");
  sub->add_flag("--json", options->json, "print the result as JSON");
  options->input.add_options(*sub);
  sub->footer("Example: loopwarden diagnose data/routine/r22.csv --json");
  sub->callback([options, &exit_code] { exit_code = run_diagnose(*options); });
}

}  // namespace loopwarden::workbench
