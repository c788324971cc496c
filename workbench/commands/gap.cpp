// SPDX-License-Identifier: Apache-2.0
// loopwarden gap: finds the effect that a model lacks, and writes a corrected model and a report.
#include "model/gap/logger.hpp"
#include "model/gap/workflow.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <limits>
#include <optional>
#include <nlohmann/json.hpp>
#include <string>

#include "config/loop_model_writer.hpp"
#include "model/analysis/identification.hpp"
#include "record/record_csv.hpp"
#include "model/effects/catalogue.hpp"
#include "model/gap/constants.hpp"
#include "model/gap/other_unit.hpp"
#include "model/gap/say.hpp"
#include "workbench/command_line/frame.hpp"
#include "workbench/files/model_file.hpp"
#include "workbench/live/daemon_client.hpp"
#include "daemon/protocol/planned_test/in_force.hpp"
#include "workbench/records/record_input.hpp"
#include "workbench/records/recorder_input.hpp"
#include "workbench/text/gap_json.hpp"
#include "workbench/text/next_test_text.hpp"
#include "workbench/text/posterior_bars.hpp"
#include "workbench/text/import_json.hpp"
#include "workbench/report/gap_report.hpp"
#include "workbench/files/output_files.hpp"
#include "workbench/command_line/progress.hpp"
#include "workbench/commands/subcommands.hpp"

namespace loopwarden::workbench {
namespace {

constexpr double kLargestLoadPercent = 0.15;  // of PV span per root second
constexpr double kClearJump = 0.1;            // j over s, at the low end of its interval

struct GapOptions {
  RecordInput input;
  RecorderInput recorder;  // in place of the record
  std::string record;
  std::string model;
  std::string out;
  std::vector<std::string> without;
  double largest_load_percent = kLargestLoadPercent;
  double from_s = -std::numeric_limits<double>::infinity();
  double to_s = std::numeric_limits<double>::infinity();
  unsigned jobs = 0;
  bool json = false;
  bool verbose = false;
  bool clip_co = false;          // CO is what the controller asked for before its limits
  bool controller_known = true;  // false: SP does not explain CO
  bool stem = false;             // only the valve: its stem in place of PV
  bool identified = false;       // the model, from this record itself
  int late = 0;                  // samples, by which CO is logged too late
  std::optional<analysis::StickingCycle> cycle{};  // that the model was identified with
  std::string tag{};                               // of the daemon's loop; empty: from a file
  std::optional<std::uint32_t> configuration{};    // CRC-32 of the file of this loop
  std::vector<double> pv_range{},
      co_range{};                 // of the record, if it differs from the model's units
  analysis::KnownRanges known{};  // of the loop, for a model that is identified
};

// Returns the parameters that were fitted, with their 95 % intervals.
std::string fitted_text(const gap::FoundEffect& effect) {
  std::string text;
  for (const auto& [name, interval] : effect.interval) {
    const auto value = effect.spec.parameters.find(name);
    if (value == effect.spec.parameters.end()) continue;
    text += fmt::format("{}{} {:.3g} [{:.3g}, {:.3g}]", text.empty() ? "" : ", ", name,
                        value->second, interval[0], interval[1]);
  }
  return text;
}

void print_effect(const gap::FoundEffect& effect) {
  std::string others;
  for (const std::string& name : effect.alternatives) others += (others.empty() ? "" : ", ") + name;
  const std::string fitted = fitted_text(effect);
  fmt::print("{} ({}): confidence {:.2f}{}{}\n", effect.spec.name, to_text(effect.block),
             effect.confidence, fitted.empty() ? "" : "; " + fitted,
             others.empty() ? "" : "; or " + others);
}

// Prints the actions, and the evidence: noise floor, remaining error, location of the error.
void print_details(const gap::Result& r) {
  for (const gap::FoundEffect& e : r.effects) fmt::print("{}: {}\n", e.spec.name, e.evidence);
  fmt::print(
      "noise floor: transmitter {:.4g}, disturbance {:.4g}{}\n", r.floor.transmitter_rmse,
      r.floor.load_rmse,
      r.floor.load_tested ? "" : "; not tested for a disturbance: " + r.floor.why_not_tested);
  if (r.remainder && r.remainder->share >= gap::kWorthSaying) {
    std::string follows;
    for (const std::string& signal : r.remainder->depends_on)
      follows += (follows.empty() ? ", follows " : " and ") + signal;
    fmt::print("remaining error: {:.4g}; looks like {}{}\n", r.remainder->rmse,
               gap::to_text(r.remainder->looks_like), follows);
  }
  if (std::isfinite(r.controller_before_rmse)) {
    fmt::print("controller: rmse of CO {:.3g}, corrected {:.3g}\n", r.controller_before_rmse,
               r.controller_after_rmse);
  }
  for (const gap::Located& l : r.located) {
    fmt::print("  {:>5.1f} %  {:<10} {:<12} {} ({:.1f} s to {:.1f} s)\n", 100.0 * l.share_of_gap,
               to_text(l.by), to_text(l.block), l.what, l.from_s, l.to_s);
  }
}

// Prints the probabilities of the likeliest hypotheses as bars.
void print_posterior(const gap::Result& r) {
  constexpr std::size_t kMost = 2;
  constexpr double kWidth = 20.0;
  const std::vector<Bar> bars = posterior_bars(r.posterior, kMost);
  for (const Bar& bar : bars) {
    std::string drawn;
    for (int i = 0; i < static_cast<int>(std::lround(kWidth * bar.probability)); ++i) drawn += "#";
    fmt::print("{:>5.0f} %  {:<20}  {}\n", 100.0 * bar.probability, drawn, bar.title);
  }
}

// At most 15 lines without --verbose.
void print_result(const gap::Result& r, const GapOptions& options) {
  constexpr std::size_t kMostEffects = 3;
  constexpr std::size_t kMostNotes = 2;
  fmt::print("{}\n", r.sentence);
  const std::vector<gap::RecordNote>& notes = r.check.notes;
  const std::size_t shown = options.verbose || notes.size() <= kMostNotes ? notes.size() : 1;
  for (std::size_t i = 0; i < shown; ++i) fmt::print("record: {}\n", notes[i].text);
  if (shown < notes.size()) {
    fmt::print("record: {} more notes, with --verbose\n", notes.size() - shown);
  }
  print_posterior(r);
  for (std::size_t i = 0; i < r.effects.size() && (options.verbose || i < kMostEffects); ++i)
    print_effect(r.effects[i]);
  if (!r.effects.empty()) {
    if (const effects::Descriptor* info = effects::find_effect(r.effects.front().spec.name))
      fmt::print("Action: {}\n", info->remedy);
  }
  if (r.next_test) {
    fmt::print("Next test: {}\n", proposed_test_text(r.next_test->plan, names_of(*r.next_test)));
  } else if (!r.why_no_test.empty()) {
    fmt::print("No small test decides. {}\n", r.why_no_test);
  }
  const auto row = [](const char* name, double rmse, double holdout, double fit_percent) {
    fmt::print("{:<18}{:>10.4g}{:>10.4g}{:>9}\n", name, rmse, holdout,
               std::isfinite(fit_percent) ? fmt::format("{:.1f} %", fit_percent) : "-");
  };
  fmt::print("{:<18}{:>10}{:>10}{:>9}   noise floor {:.4g}\n", "rmse, PV units", "fitted", "unseen",
             "fit", r.floor.rmse());
  row("model as given", r.before.training_rmse, r.before.holdout_rmse,
      r.before.holdout_fit_percent);
  row("model corrected", r.after.training_rmse, r.after.holdout_rmse, r.after.holdout_fit_percent);
  if (options.verbose) print_details(r);
  fmt::print("{0}/report.html, {0}/gap.json, {0}/model.corrected.yaml\n", options.out);
}

// Returns the words that --without accepts.
std::vector<std::string> words_without() {
  std::vector<std::string> words{"several", "load"};
  for (const effects::Descriptor& info : effects::vocabulary()) {
    // The only noise that is ever named is that of a transmitter.
    if (!info.is_noise || info.blocks.front() == effects::Block::transmitter)
      words.emplace_back(info.name);
  }
  return words;
}

// Returns whether an effect belongs to the valve or its read-back.
bool shows_in_stem(const effects::Descriptor& info) {
  constexpr std::array<std::string_view, 4> kOfReading{"output_bias", "gain_change",
                                                       "extra_dead_time", "learned"};
  return info.blocks.front() == effects::Block::valve ||
         std::find(kOfReading.begin(), kOfReading.end(), info.name) != kOfReading.end();
}

gap::Options search_options(const GapOptions& options) {
  gap::Options out;
  const auto left_out = [&](const char* word) {
    return std::find(options.without.begin(), options.without.end(), word) != options.without.end();
  };
  out.search.several = !left_out("several");
  out.search.load = !left_out("load");
  out.search.without = options.without;
  // A model that was identified from changes has no valid level of PV.
  out.search.level_of_record = options.identified;
  if (options.cycle) {
    // The process was identified together with the valve. A second effect would describe an error
    // of that process.
    out.search.several = false;
    // A jump of this size excludes backlash and hysteresis.
    if (options.cycle->j.low > kClearJump * options.cycle->s.value) {
      out.search.without.insert(out.search.without.end(), {"backlash", "hysteresis"});
    }
  }
  if (options.stem) {
    for (const effects::Descriptor& info : effects::vocabulary()) {
      if (!shows_in_stem(info)) out.search.without.emplace_back(info.name);
    }
  }
  out.largest_load = options.largest_load_percent / 100.0;
  return out;
}

// Returns the options that change the answer, for the command in the report.
std::string used_options(const GapOptions& options) {
  std::string text;
  const auto add = [&](const std::string& option) { text += (text.empty() ? "" : " ") + option; };
  if (std::isfinite(options.from_s)) add(fmt::format("--from {}", options.from_s));
  if (std::isfinite(options.to_s)) add(fmt::format("--to {}", options.to_s));
  if (options.largest_load_percent != kLargestLoadPercent) {
    add(fmt::format("--largest-load {}", options.largest_load_percent));
  }
  for (const std::string& word : options.without) add("--without " + word);
  if (!options.pv_range.empty())
    add(fmt::format("--pv-range {} {}", options.pv_range[0], options.pv_range[1]));
  if (!options.co_range.empty())
    add(fmt::format("--co-range {} {}", options.co_range[0], options.co_range[1]));
  if (options.clip_co) add("--clip-co");
  if (options.stem) add("--stem");
  return text;
}

// Writes the reason as a page, unless it would replace the results of an earlier run.
void write_refusal(OutputFiles& files, const gap::Result& result, const GapReportContext& context) {
  const std::filesystem::path out(context.out);
  if (std::filesystem::exists(out / "gap.json")) {
    fmt::print(stderr, "{}: results of an earlier run, unchanged\n", context.out);
    return;
  }
  files.add(out / "report.html", gap_report_html(result, context));
  files.commit();
}

// Returns the columns between --from and --to. `first_s`: receives the time of the file's first
// sample.
numeric::LoopRecord stretch_of(const record::Record& file, const GapOptions& options,
                               double& first_s) {
  const auto& time = file.time_s;
  const auto begin = std::lower_bound(time.begin(), time.end(), options.from_s) - time.begin();
  const auto end = std::upper_bound(time.begin(), time.end(), options.to_s) - time.begin();
  if (begin >= end) {
    throw record::RecordError(
        record::RecordError::Kind::data, 0, 0,
        fmt::format("{}: no samples{}{}; the record runs from {:g} s to {:g} s", options.record,
                    std::isfinite(options.from_s) ? fmt::format(" from {:g} s on", options.from_s)
                                                  : std::string(),
                    std::isfinite(options.to_s) ? fmt::format(" up to {:g} s", options.to_s)
                                                : std::string(),
                    time.front(), time.back()));
  }
  first_s = time[static_cast<std::size_t>(begin)];
  return file.part(static_cast<std::size_t>(begin), static_cast<std::size_t>(end));
}

double output_span(const plant::LoopModel& model) { return model.controller.pid.output_span(); }

// A long record takes minutes and is mostly uninformative. Uses the part with most movement.
constexpr std::size_t kLongestGap = 12000;  // samples

void choose_stretch(record::Imported& imported, GapOptions& options) {
  const record::Record& r = imported.record;
  if (r.size() <= 2 * kLongestGap || std::isfinite(options.from_s) || std::isfinite(options.to_s))
    return;
  const std::size_t from = telling_part(r, kLongestGap);
  options.from_s = r.time_s[from];
  options.to_s = r.time_s[std::min(from + kLongestGap, r.size()) - 1];
  fmt::print(stderr,
             "{}: {} samples: the {:g} s from {:g} s on, in which most moves; --from and --to "
             "choose another part\n",
             options.record, r.size(), options.to_s - options.from_s, options.from_s);
}

// Applies --pv-range and --co-range: record values that correspond to the ends of the model's
// ranges.
void convert_units(record::Record& r, const plant::LoopModel& model, const GapOptions& options) {
  const auto& pid = model.controller.pid;
  const auto unit = [](const std::vector<double>& told, double low, double high) {
    return told.empty() ? gap::SignalUnit{"", low, high} : gap::SignalUnit{"", told[0], told[1]};
  };
  static_cast<numeric::LoopRecord&>(r) = gap::in_models_units(
      r, model, unit(options.pv_range, model.transmitter.low, model.transmitter.high),
      unit(options.co_range, pid.output_low, pid.output_high));
  if (!options.clip_co) return;
  for (double& v : r.co) v = std::clamp(v, pid.output_low, pid.output_high);
}

// Asks whether the record has other units, with the options for both answers. Empty: the model's
// units fit.
std::string unit_question(const numeric::LoopRecord& record, const plant::LoopModel& model) {
  const std::optional<gap::OtherUnit> found = gap::other_unit(record, model);
  if (!found) return {};
  std::string names;
  std::string yes;
  std::string no;
  const auto add = [&](const gap::SignalUnit& unit, const char* option, double low, double high) {
    if (unit.name.empty()) return;
    names += (names.empty() ? "" : ", ") + unit.name;
    yes += fmt::format(" {} {:g} {:g}", option, unit.low, unit.high);
    no += fmt::format(" {} {:g} {:g}", option, low, high);
  };
  add(found->pv, "--pv-range", model.transmitter.low, model.transmitter.high);
  add(found->co, "--co-range", model.controller.pid.output_low, model.controller.pid.output_high);
  return fmt::format(
      "PV or CO looks like another unit ({}): converted, the model misses PV by {:.3g} instead of "
      "{:.3g}. No effect is named. To confirm:{}; to deny:{}",
      names, found->rmse_converted, found->rmse_as_it_stands, yes, no);
}

// Replaces PV by the stem. SP is removed, because it does not apply to the stem.
void take_stem(record::Record& r, const std::string& name) {
  if (r.stem.empty()) {
    fail(kExitData, "{}: has no column stem. Name it: --map pv=NAME,co=NAME,stem=NAME", name);
  }
  if (r.co.empty()) fail(kExitData, "{}: has no column co, which the stem should follow", name);
  r.pv = r.stem;
  r.sp.clear();
}

// Returns the deviations within which an archive kept PV and CO. If that of CO is undecidable, it
// is assumed to be the same share of the span as that of PV, because historians are usually
// configured so.
gap::Deviations deviations_of(const record::ImportNotes& notes, const plant::LoopModel& model,
                              bool pv_as_stored) {
  const auto told = [](const analysis::ArchivedSignal& signal) {
    return signal.kind == analysis::ArchiveKind::none ||
           (signal.kind != analysis::ArchiveKind::unknown && signal.deviation > 0.0);
  };
  gap::Deviations out{notes.pv.deviation, notes.co.deviation, pv_as_stored || told(notes.pv)};
  if (told(notes.co)) return out;
  out.co = notes.pv.deviation / model.transmitter.span() * output_span(model);
  out.known = out.known && (pv_as_stored || out.co > 0.0);
  return out;
}

// Removes interpolated values of PV.
void leave_out_guesses(record::Imported& imported) {
  for (std::size_t k = 0; k < imported.pv_drawn.size(); ++k) {
    if (imported.pv_drawn[k]) imported.record.pv[k] = std::numeric_limits<double>::quiet_NaN();
  }
}

// Returns tag, units and clock of the export; empty for the fixed format, which does not have them.
std::string source_text(const record::ImportNotes& notes) {
  if (notes.layout.empty()) return {};
  std::string text = "Loop " + notes.tag;
  for (const record::Role role : {record::Role::pv, record::Role::co}) {
    const std::string& name = notes.names[index_of(role)];
    const std::string& unit = notes.units[index_of(role)];
    if (!name.empty())
      text += fmt::format(", {} '{}'{}", to_text(role), name, unit.empty() ? "" : " in " + unit);
  }
  if (notes.start) {
    text += "; time 0 of the record is " +
            record::iso_text(notes.start->whole_s, notes.start->rest_s, notes.start->zone_known);
  }
  return text + ".";
}

record::Imported read_loop(const GapOptions& options) {
  record::Imported imported = options.input.read(options.record);
  if (!options.stem) return imported;
  take_stem(imported.record, options.record);
  imported.notes.pv = {};  // that was PV's
  imported.pv_drawn.clear();
  return imported;
}

struct Found {
  gap::Result result;
  record::ImportNotes notes;
  std::optional<double> sees_from_percent;  // if an archive compressed the record
};

Found look_for_gap(GapOptions options, const plant::LoopModel& model) {
  Found found;
  try {
    double first_s = 0.0;
    record::Imported imported = read_loop(options);
    choose_stretch(imported, options);
    convert_units(imported.record, model, options);
    draw_for_judging(imported);
    leave_out_guesses(imported);
    numeric::LoopRecord record = stretch_of(imported.record, options, first_s);
    record.pv_as_stored = !imported.pv_drawn.empty();
    if (options.late > 0) record = gap::with_co_moved_back(record, options.late);
    if (!options.controller_known) record.sp.clear();
    say_if_long(options.record, record.pv.size());
    Progress progress("gap", 100);
    const ParallelFor parallel = on_threads(threads(options.jobs));
    const auto told = [&progress](double share) { progress.update_share(share); };
    const gap::Deviations deviations = deviations_of(imported.notes, model, record.pv_as_stored);
    gap::Options how = search_options(options);
    how.co_in_lines = imported.notes.co.kind == analysis::ArchiveKind::swinging_door;
    if (options.controller_known && options.pv_range.empty() && options.co_range.empty()) {
      if (const std::string question = unit_question(record, model); !question.empty()) {
        fail(kExitData, "{}: {}", options.record, question);
      }
    }
    if (imported.notes.compressed()) {
      how.archive = deviations;
      if (deviations.known)
        found.sees_from_percent = 100.0 * gap::sees_from(model, deviations) / output_span(model);
    }
    found.result = gap::find_gap(record, model, how, parallel, told);
    found.notes = std::move(imported.notes);
    if (options.stem) {
      found.result.check.notes.push_back(
          {"stem", "The stem replaces PV: only the valve is examined, in CO units."});
    }
    if (options.late > 0) {
      found.result.check.notes.push_back(
          {"logger",
           fmt::format("CO is logged {} sample{} too late against PV: it is taken back by "
                       "as much.",
                       options.late, options.late > 1 ? "s" : "")});
    }
    if (const std::string source = source_text(found.notes); !source.empty())
      found.result.check.notes.push_back({"source", source});
    if (first_s != 0.0) {
      found.result.check.notes.push_back(
          {"stretch", fmt::format("Times count from {:g} s of the record.", first_s)});
    }
    return found;
  } catch (const effects::EffectError& e) {
    fail(kExitConfiguration, "{}: {}", options.model, e.what());
  }
}

// Writes the plan and the record that it was made from, in the model's units.
void write_plan(OutputFiles& files, const std::filesystem::path& out, const gap::Result& result,
                const GapOptions& options) {
  constexpr const char* kRecord = "next_test.record.csv";
  TestPlanFile plan = plan_file(result);
  plan.loop = options.tag;
  plan.configuration = options.configuration;
  plan.planned_at = static_cast<std::int64_t>(std::time(nullptr));
  plan.model = std::filesystem::proximate(options.model, out).string();
  plan.record = kRecord;
  plan.without = options.without;
  plan.level_of_record = options.identified;
  record::Record record;
  const gap::Series& series = result.series;
  record.period_s = result.model.sample_time_s;
  record.time_s = series.time_s;
  record.pv = series.pv;
  record.sp = series.sp;
  record.co = series.co;
  record::write_record(record, files.stage(out / kRecord));
  files.add(out / "next_test.yaml",
            write_test_plan(
                plan, "Proposed by loopwarden gap. " + test_sentence(result.next_test->plan)));
}

int run_gap(const GapOptions& options) {
  for (const std::vector<double>* range : {&options.pv_range, &options.co_range}) {
    if (!range->empty() && !((*range)[0] < (*range)[1])) {
      fail(kExitUsage, "a range needs a lower and an upper end, as 0 100");
    }
  }
  const auto begin = std::chrono::steady_clock::now();
  const plant::LoopModel model = load_model(options.model);
  const std::filesystem::path out(options.out);
  OutputFiles files({options.record, options.model});
  files.make_folder(out);  // before the work, not after it
  for (const char* name : {"model.corrected.yaml", "gap.json", "report.html"}) {
    files.expect(out / name);
  }
  const auto [result, notes, sees_from_percent] = look_for_gap(options, model);
  GapReportContext context{
      .record = options.record,
      .record_stays = !options.recorder.background(),
      .model = options.model,
      .model_text = text_of(options.model),
      .corrected_text = "",
      .out = options.out,
      .options = used_options(options),
      .seconds_of_work =
          std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count(),
      .version = LOOPWARDEN_VERSION};
  nlohmann::json answer = gap_json(result);
  answer["import"] =
      import_json(notes, {model.transmitter.span(), output_span(model)}, sees_from_percent);
  if (!result.check.usable) {
    fmt::print(stderr, "{}: {}\n", options.record, result.check.refusal);
    write_refusal(files, result, context);
    return kExitData;
  }
  context.corrected_text = config::write_model(
      result.corrected, "loop model corrected by loopwarden gap\n" + result.sentence);
  files.add(out / "model.corrected.yaml", context.corrected_text);
  files.add(out / "report.html", gap_report_html(result, context));
  files.add(out / "gap.json", answer.dump(2) + "\n");
  if (result.next_test) write_plan(files, out, result, options);
  files.commit();
  if (options.recorder.background()) {
    fmt::print("{}\n", result.sentence);
  } else {
    options.json ? show_json(answer) : print_result(result, options);
  }
  return kExitOk;
}

// Without --model: identifies a model from the record and writes it with the results.
int run_gap_on_assumed_model(GapOptions options) {
  const std::filesystem::path out(options.out);
  OutputFiles files({options.record});
  files.make_folder(out);
  try {
    double first_s = 0.0;
    record::Imported imported = read_loop(options);
    choose_stretch(imported, options);
    const numeric::LoopRecord record = stretch_of(imported.record, options, first_s);
    if (options.stem) {
      options.model = (out / "model.assumed.yaml").string();
      options.controller_known = false;
      files.add(options.model,
                config::write_model(analysis::stem_follows_output(record.co, record.period_s),
                                    "assumed by loopwarden gap: the stem follows CO"));
      files.commit();
      return run_gap(options);
    }
    if (!record.has_co()) {
      fail(kExitData, "{}: has no column co; a model can't be identified without it: --model",
           options.record);
    }
    numeric::LoopView loop = record.view();
    loop.stem = {};
    const analysis::AssumedModel assumed = analysis::assumed_model(loop, options.known);
    if (!assumed.model) {
      fail(kExitData, "{}: no model can be identified: {} {}", options.record,
           assumed.identification.reason, assumed.identification.settle);
    }
    std::string heading = "assumed by loopwarden gap from " + options.record;
    for (const std::string& assumption : assumed.assumptions) {
      if (options.verbose) fmt::print(stderr, "assumed: {}\n", assumption);
      heading += "\n" + assumption;
    }
    options.model = (out / "model.assumed.yaml").string();
    fmt::print(stderr, "No --model: identified from the record, with assumptions, in {}\n",
               options.model);
    options.controller_known = assumed.controller_known;
    options.identified = true;
    options.late = static_cast<int>(assumed.identification.late);
    options.cycle = assumed.identification.cycle;
    files.add(options.model, config::write_model(*assumed.model, heading));
    files.commit();
  } catch (const analysis::IdentificationError& e) {
    fail(kExitData, "{}: no model can be identified: {}", options.record, e.what());
  }
  return run_gap(options);
}

// Takes the recorder's longest stretch in place of a file and keeps it with the results.
void take_from_recorder(GapOptions& options, OutputFiles& files) {
  const std::filesystem::path folder = std::filesystem::path(options.out) / "records";
  files.make_folder(folder);
  const Recorded recorded = options.recorder.take(options.input.loop(), folder);
  options.record = recorded.longest().path;
  options.known = recorded.ranges();
  options.tag = recorded.loop.tag;
  // Only the plan of a test needs it. Without it, valve-test compares the plan's time.
  try {
    DaemonClient daemon(options.recorder.socket());
    if (const auto file = protocol::file_of_loop(daemon, options.tag))
      options.configuration = file->hash;
  } catch (const protocol::DaemonError&) {
    options.configuration.reset();
  }
  if (recorded.records.size() > 1) {
    fmt::print(stderr, "{}: the longest of {} stretches without a break\n", options.record,
               recorded.records.size());
  }
  options.input = RecordInput();  // its loop is the folder's, not a column's
}

int run_any_gap(const GapOptions& given) {
  GapOptions options = given;
  OutputFiles kept;
  if (options.recorder.asked(!options.record.empty(), options.input.loop())) {
    take_from_recorder(options, kept);
    kept.commit();
  }
  return options.model.empty() ? run_gap_on_assumed_model(options) : run_gap(options);
}

}  // namespace

void add_gap(Program& program) {
  auto [command, o] = program.command(
      "gap", "Find the effect that a model lacks, and correct the model", run_any_gap);
  command.option("record", o.record, "measured record, CSV: time, pv, and if known sp, co");
  o.recorder.add_options(command,
                         "; a model that is identified gets PV's and CO's range from the daemon's "
                         "loop. The record is kept in the folder records of --out");
  command.option("--model", o.model,
                 "loop model as its engineers know it, YAML; default: identified from the record "
                 "and written to model.assumed.yaml");
  command.required("--out", o.out, "folder for gap.json, model.corrected.yaml, report.html");
  command.option("--from", o.from_s, "start of the used part, s of the record");
  command.option("--to", o.to_s, "end of the used part, s of the record");
  command.setting("--largest-load", o.largest_load_percent,
                  "intensity of the unmeasured disturbance to ignore, % of PV span per sqrt(s)",
                  between(0.0, 100.0));
  command.option("--without", o.without,
                 "step or effect to leave out: several, load, learned, stiction, ...; repeatable",
                 one_of(words_without()));
  command.setting("--jobs", o.jobs, "threads; 0: one per core. The answer does not depend on it");
  command.flag("--json", o.json, "print gap.json");
  command.flag("--verbose", o.verbose,
               "also print assumptions, evidence and the location of the error");
  command
      .option("--pv-range", o.pv_range,
              "PV and SP of the record at the ends of the model's range, if the units differ, such "
              "as 0 100 for %")
      .takes(2);
  command
      .option(
          "--co-range", o.co_range,
          "CO of the record at the ends of the model's range, such as 0 1 for a share, 4 20 for mA")
      .takes(2);
  command.flag("--stem", o.stem,
               "examine only the valve: column stem in place of pv; without --model, a stem that "
               "follows co");
  command.flag(
      "--clip-co", o.clip_co,
      "limit the recorded CO to the model's limits, because it was logged before its limits");
  o.input.add_options(command);
  command.footer(
      "Examples: loopwarden gap record.csv --model model.yaml --out result\n"
      "          loopwarden gap --loop FIC-205 --last 4h --model twin.yaml --out result");
}

}  // namespace loopwarden::workbench
