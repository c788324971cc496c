// SPDX-License-Identifier: Apache-2.0
// loopwarden outcome: stores a fitter's finding at a loop that a survey named.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "base/text.hpp"
#include "config/diagnostic.hpp"
#include "daemon/protocol/ask.hpp"
#include "record/import/importer.hpp"
#include "record/import/number_text.hpp"
#include "record/import/time_text.hpp"
#include "workbench/command_line/frame.hpp"
#include "workbench/command_line/progress.hpp"
#include "workbench/commands/subcommands.hpp"
#include "workbench/files/output_files.hpp"
#include "workbench/live/daemon_client.hpp"
#include "workbench/live/loop_view.hpp"
#include "workbench/records/record_input.hpp"
#include "workbench/survey/changes.hpp"
#include "workbench/survey/outcomes.hpp"
#include "workbench/survey/test_log.hpp"
#include "workbench/text/csv_text.hpp"

namespace loopwarden::workbench {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using record::Role;

struct OutcomeCommand {
  std::string tag;
  std::string found;
  std::string note;
  std::string survey = "survey";
  std::string socket;  // of a daemon, in place of a survey
  std::string out;
  std::vector<std::string> from;
  RecordInput input;
  bool repaired = false;
  std::string changed;
  bool list = false;
  bool tests = false;
  bool json = false;
};

// Returns the loop of survey.json with this tag. The case is ignored if that selects one loop.
const json& surveyed_loop(const json& survey, const std::string& tag, const fs::path& folder) {
  std::vector<std::string> tags;
  const json* like = nullptr;
  std::size_t alike = 0;
  for (const json& loop : survey.at("loops")) {
    tags.push_back(loop.at("tag").get<std::string>());
    if (tags.back() == tag) return loop;
    if (base::lower_case(tags.back()) != base::lower_case(tag)) continue;
    like = &loop;
    ++alike;
  }
  if (alike == 1) return *like;
  fail(kExitData, "{}: no loop {}{}", (folder / "survey.json").string(), base::in_quotes(tag),
       config::suggestion(tag, tags));
}

std::string size_said(const FitterAnswer& o) {
  return o.percent_of_span ? fmt::format(" {:.2g} %", *o.percent_of_span) : std::string();
}

json outcome_json(const FitterAnswer& o) {
  const auto number = [](const std::optional<double>& value) {
    return value ? json(*value) : json(nullptr);
  };
  return {{"answered", o.answered},
          {"tag", o.tag},
          {"found", to_text(o.found)},
          {"note", o.note},
          {"verdict", o.verdict},
          {"grade", o.grade},
          {"effect", o.effect},
          {"percent_of_span", number(o.percent_of_span)},
          {"probability", number(o.probability)},
          {"data_from", o.data_from},
          {"data_to", o.data_to}};
}

int list_outcomes(const OutcomeCommand& options) {
  const std::vector<FitterAnswer> outcomes =
      read_outcomes(fs::path(options.survey) / kOutcomesFile);
  json told = precision_json(outcomes);
  if (options.json) {
    told["outcomes"] = json::array();
    for (const FitterAnswer& o : outcomes) told["outcomes"].push_back(outcome_json(o));
    show_json(told);
    return kExitOk;
  }
  if (outcomes.empty()) {
    fmt::print("no answers yet\n");
    return kExitOk;
  }
  fmt::print("{:<10}  {:<24} {:<10} {:<24} {}\n", "answered", "loop", "found", "survey's finding",
             "note");
  for (const FitterAnswer& o : outcomes) {
    constexpr std::size_t kDay = 10;
    const std::string said = o.effect.empty() ? o.verdict : o.effect + size_said(o) + " " + o.grade;
    fmt::print("{:<10}  {:<24} {:<10} {:<24} {}\n", o.answered.substr(0, kDay), o.tag,
               to_text(o.found), said, o.note);
  }
  fmt::print("{}\n", precision_text(told));
  return kExitOk;
}

// --- loops of the daemon ---

int keep_in_journal(const OutcomeCommand& options) {
  DaemonClient daemon(options.socket);
  loop_index(protocol::ask(daemon, protocol::StatusRequest{}).loops, options.tag);
  protocol::OutcomeRequest request{.loop = options.tag, .found = options.found};
  if (!options.note.empty()) request.note = options.note;
  const protocol::OutcomeKept answer = protocol::ask(daemon, request);
  if (options.json) {
    show_json(answer);
    return kExitOk;
  }
  fmt::print("{}: {} found; the daemon's finding: {}{}\n", options.tag, options.found, answer.said,
             answer.on_disk ? "" : "; the journal cannot be written, so a restart may lose this");
  return kExitOk;
}

// Prints the newest answers.
int list_journal(const OutcomeCommand& options) {
  constexpr std::size_t kMost = 1000;
  DaemonClient daemon(options.socket);
  json lines = json::array();
  protocol::JournalRequest request{.most = kMost, .text = "outcome"};
  if (!options.tag.empty()) request.loop = options.tag;
  for (const protocol::JournalLine& line : protocol::ask(daemon, request).lines) {
    if (line.what != "outcome") continue;
    lines.push_back({{"answered", record::iso_text(line.utc_ms / 1000, 0.0, true)},
                     {"tag", line.loop},
                     {"found", line.new_},
                     {"said", line.old_},
                     {"note", line.reason},
                     {"by", line.peer}});
  }
  if (options.json) {
    show_json(lines);
    return kExitOk;
  }
  if (lines.empty()) fmt::print("no answers yet\n");
  for (const json& line : lines) {
    const auto part = [&](const char* key) { return line.at(key).get<std::string>(); };
    fmt::print("{}  {:<16} {:<10} the daemon's finding: {}; {}\n", part("answered"), part("tag"),
               part("found"), part("said"), part("note"));
  }
  return kExitOk;
}

// --- anonymous records ---

// Returns the range of samples that the survey judged, with its end excluded.
std::pair<std::size_t, std::size_t> judged_part(const record::Imported& imported,
                                                const FitterAnswer& o) {
  const std::vector<double>& time_s = imported.record.time_s;
  const auto second = [&](const std::string& moment, double otherwise) {
    const auto at = record::parse_time(moment, record::TimeForm::ymd);
    if (at && imported.notes.start) return at->since(*imported.notes.start);
    const auto number = record::parse_number(moment, '.');
    return number && !imported.notes.start ? *number : otherwise;
  };
  constexpr double kRounding = 1e-3;  // s
  constexpr double kAlways = std::numeric_limits<double>::infinity();
  const auto from =
      std::lower_bound(time_s.begin(), time_s.end(), second(o.data_from, -kAlways) - kRounding);
  const auto to = std::upper_bound(from, time_s.end(), second(o.data_to, kAlways) + kRounding);
  return {static_cast<std::size_t>(from - time_s.begin()),
          static_cast<std::size_t>(to - time_s.begin())};
}

record::SignalRange extent_of(const std::vector<const std::vector<double>*>& columns) {
  double low = std::nan("");
  double high = std::nan("");
  for (const std::vector<double>* column : columns) {
    for (const double v : *column) {
      if (!std::isfinite(v)) continue;
      if (!(low <= v)) low = v;
      if (!(high >= v)) high = v;
    }
  }
  return high > low ? record::SignalRange(low, high) : record::SignalRange(low, low + 1.0);
}

void scale_to_percent(std::vector<double>& column, const record::SignalRange& range) {
  for (double& v : column) v = 100.0 * (v - range.first) / (range.second - range.first);
}

struct Anonymous {
  record::Record record;
  bool pv_by_range = false;  // else by the least and the greatest value of PV and SP
};

// Returns a record with times from 0 and values in % of their ranges, without tag, unit and clock.
Anonymous anonymous(record::Imported imported, const FitterAnswer& outcome,
                    const record::SignalRange& co_range) {
  const auto [from, to] = judged_part(imported, outcome);
  Anonymous made;
  record::Record& r = imported.record;
  for (std::vector<double>* column : {&r.time_s, &r.pv, &r.sp, &r.co, &r.stem, &r.automatic}) {
    if (column->size() < to) continue;
    *column = std::vector<double>(column->begin() + static_cast<std::ptrdiff_t>(from),
                                  column->begin() + static_cast<std::ptrdiff_t>(to));
  }
  for (std::size_t k = 0; k < r.time_s.size(); ++k)
    r.time_s[k] = static_cast<double>(k) * r.period_s;
  const auto& told = imported.notes.ranges[index_of(Role::pv)];
  made.pv_by_range = told.has_value();
  const record::SignalRange pv_range = told.value_or(extent_of({&r.pv, &r.sp}));
  scale_to_percent(r.pv, pv_range);
  scale_to_percent(r.sp, pv_range);
  scale_to_percent(r.co, co_range);
  scale_to_percent(r.stem,
                   imported.notes.ranges[index_of(Role::stem)].value_or(extent_of({&r.stem})));
  made.record = std::move(r);
  return made;
}

class Export {
 public:
  Export(const OutcomeCommand& options, const std::vector<FitterAnswer>& outcomes,
         const json& survey)
      : out_(options.out), outcomes_(outcomes), survey_(survey), files_(options.from) {
    files_.make_folder(out_);
  }

  // Numbers the loops in the order of the answers.
  void take(const record::Imported& imported) {
    for (std::size_t k = 0; k < outcomes_.size(); ++k) {
      if (outcomes_[k].tag == imported.notes.tag) take(imported, k);
    }
  }
  void commit() {
    std::string labels =
        "file,found,kind,verdict,effect,percent_of_span,grade,probability,pv_scaled_by\n";
    for (const auto& [number, line] : lines_) labels += line;
    files_.add(out_ / "labels.csv", labels);
    files_.commit();
  }
  std::size_t records() const noexcept { return lines_.size(); }
  // Returns the loops with an answer but without data in the exports.
  std::vector<std::string> missing() const {
    std::vector<std::string> tags;
    for (std::size_t k = 0; k < outcomes_.size(); ++k) {
      if (lines_.count(k) == 0) tags.push_back(outcomes_[k].tag);
    }
    return tags;
  }

 private:
  void take(record::Imported imported, std::size_t number) {
    const FitterAnswer& o = outcomes_[number];
    record::SignalRange co_range = extent_of({&imported.record.co});
    std::string kind = "unknown";
    for (const json& loop : survey_.at("loops")) {
      if (loop.at("tag") != o.tag) continue;
      co_range = {loop.at("co_range").at(0).get<double>(), loop.at("co_range").at(1).get<double>()};
      kind = loop.at("kind").get<std::string>();
    }
    const Anonymous made = anonymous(std::move(imported), o, co_range);
    if (made.record.size() < 2) return;
    const std::string name = fmt::format("record-{:04}.csv", number + 1);
    try {
      record::write_record(made.record, files_.stage(out_ / name));
    } catch (const record::RecordError& e) {
      throw CommandError(kExitIo, files_.in_users_words(e.what()));
    }
    const auto text = [](const std::optional<double>& value) {
      return value ? fmt::format("{:.6g}", *value) : std::string();
    };
    lines_[number] =
        fmt::format("{},{},{},{},{},{},{},{},{}\n", name, to_text(o.found), csv_cell(kind),
                    csv_cell(o.verdict), csv_cell(o.effect), text(o.percent_of_span),
                    csv_cell(o.grade), text(o.probability), made.pv_by_range ? "range" : "extent");
  }

  fs::path out_;
  const std::vector<FitterAnswer>& outcomes_;
  const json& survey_;
  OutputFiles files_;
  std::map<std::size_t, std::string> lines_;  // of labels.csv, by outcome
};

int export_records(const OutcomeCommand& options) {
  if (options.from.empty()) require("outcome --export: --from with the exports that were surveyed");
  const fs::path folder(options.survey);
  const std::vector<FitterAnswer> outcomes = read_outcomes(folder / kOutcomesFile);
  if (outcomes.empty()) fail(kExitData, "{}: no answers yet", (folder / kOutcomesFile).string());
  const json survey = read_survey(folder);
  record::Importer importer({options.from.begin(), options.from.end()}, options.input.options(),
                            true);
  Export records(options, outcomes, survey);
  Progress progress("outcome: export", importer.loops().size());
  for (std::size_t k = 0; k < importer.loops().size(); ++k) {
    const record::FoundLoop& loop = importer.loops()[k];
    const bool wanted = loop.signals.has(Role::pv) && loop.signals.has(Role::co) &&
                        std::any_of(outcomes.begin(), outcomes.end(),
                                    [&](const FitterAnswer& o) { return o.tag == loop.tag; });
    progress.update(k);
    if (!wanted) continue;
    const std::array<std::size_t, 1> which{k};
    importer.read(
        which, [&](std::size_t, const record::Imported& imported) { records.take(imported); },
        [](std::size_t, std::size_t, const record::RecordError& e) {
          fmt::print(stderr, "{}\n", e.what());
        });
  }
  for (const record::FileProblem& problem : importer.problems())
    fmt::print(stderr, "{}\n", problem.why);
  const std::vector<std::string> missing = records.missing();
  if (!missing.empty()) {
    fmt::print(stderr, "not in these exports, for the time that was judged: {}\n",
               fmt::join(missing, ", "));
  }
  if (records.records() == 0) fail(kExitData, "no record could be written");
  records.commit();
  fmt::print("{} of {} records\n{}\n", records.records(), outcomes.size(),
             (fs::path(options.out) / "labels.csv").string());
  return missing.empty() ? kExitOk : kExitData;
}

int keep_answer(const OutcomeCommand& options) {
  if (options.tag.empty() || options.found.empty())
    require("outcome: TAG and --found, or --list, or --export");
  if (!options.socket.empty()) return keep_in_journal(options);
  const fs::path folder(options.survey);
  const json survey = read_survey(folder);
  const FitterAnswer outcome = answer_for(surveyed_loop(survey, options.tag, folder),
                                          *found_from(options.found), options.note);
  const fs::path file = folder / kOutcomesFile;
  keep_outcome(file, outcome);
  if (options.json) {
    show_json(outcome_json(outcome));
    return kExitOk;
  }
  fmt::print("{}: {} found; the survey's finding: {}{}\n{}\n", outcome.tag, to_text(outcome.found),
             outcome.effect.empty() ? outcome.verdict : outcome.effect, size_said(outcome),
             file.string());
  return kExitOk;
}

// Returns the tests in the daemon's journal, oldest first. Their numbers are those of its lines.
std::vector<KeptTest> tests_of_journal(const OutcomeCommand& options) {
  constexpr std::size_t kMost = 1000;
  DaemonClient daemon(options.socket);
  protocol::JournalRequest request{.most = kMost, .kind = "test", .text = "test result"};
  if (!options.tag.empty()) request.loop = options.tag;
  std::vector<KeptTest> tests;
  for (const protocol::JournalLine& line : protocol::ask(daemon, request).lines) {
    // "stiction or backlash: 0.960"
    const auto split = [](const std::string& text) {
      const std::size_t at = text.rfind(": ");
      if (at == std::string::npos) return std::pair(std::string(), 0.0);
      const auto number = record::parse_number(text.substr(at + 2), '.');
      return std::pair(text.substr(0, at), number.value_or(0.0));
    };
    if (line.what != "test result") continue;
    const auto [explanations, predicted] = split(line.old_);
    const auto [decided, probability] = split(line.new_);
    tests.push_back({.ended = record::iso_text(line.utc_ms / 1000, 0.0, true),
                     .loop = line.loop,
                     .explanations = explanations,
                     .predicted = predicted,
                     .decided = decided,
                     .probability = probability});
  }
  std::reverse(tests.begin(), tests.end());
  return tests;
}

int score_tests(const OutcomeCommand& options) {
  const std::vector<KeptTest> tests = options.socket.empty()
                                          ? read_tests(fs::path(options.survey) / kTestsFile)
                                          : tests_of_journal(options);
  if (options.json) {
    show_json(score_json(tests));
  } else {
    fmt::print("{}", tests_text(tests));
  }
  return kExitOk;
}

int run_outcome(const OutcomeCommand& given) {
  if (given.tests) return score_tests(given);
  OutcomeCommand options = given;
  if (options.repaired) {
    if (options.found.empty() || options.found == "nothing")
      fail(kExitUsage, "--repaired: add --found with the fault that was repaired");
    options.note =
        std::string(protocol::kRepaired) + (options.note.empty() ? "" : "; " + options.note);
  }
  if (!options.changed.empty()) {
    if (options.socket.empty()) require("--socket with --changed");
    if (options.found.empty()) options.found = "nothing";
    options.note = fmt::format("{}: {}{}{}", protocol::kChanged, options.changed,
                               options.note.empty() ? "" : "; ", options.note);
  }
  if (options.list) return options.socket.empty() ? list_outcomes(options) : list_journal(options);
  return options.out.empty() ? keep_answer(options) : export_records(options);
}

}  // namespace

void add_outcome(Program& program) {
  auto [command, o] = program.command(
      "outcome", "Record what a technician found at a valve, so that the next survey uses it",
      run_outcome);
  command.option("tag", o.tag, "tag of the loop");
  command.option("--found", o.found, "what was found at the valve; other: not the valve",
                 one_of(found_words()));
  const Option repaired = command.flag(
      "--repaired", o.repaired,
      "the fault was repaired now: loopwarden receipt compares the records before and after");
  command
      .option("--changed", o.changed,
              "what was changed now without a fault, such as \"positioner gain 8 to 12\": as "
              "--repaired, for a loop of the daemon")
      .excludes(repaired);
  command.option("--note", o.note, "note of the technician");
  const Option survey = command.setting(
      "--survey", o.survey, "folder of the survey, whose outcomes.csv receives the answer");
  command
      .option("--socket", o.socket,
              "of a loop of the daemon, such as /run/loopwardend/control.sock: its journal "
              "receives the answer")
      .excludes(survey);
  command.flag("--list", o.list, "print the answers, and how often the survey was right");
  command.flag("--tests", o.tests,
               "print the tests of `valve-test --plan`, and how often they decided as predicted");
  command.option("--export", o.out,
                 "folder for one anonymous record per loop (times from 0, values in % of their "
                 "ranges, no tag, no unit) and labels.csv");
  command.option("--from", o.from,
                 "with --export: the exports that were surveyed, and folders of them");
  command.flag("--json", o.json, "print JSON");
  o.input.add_options(command, false);
  o.input.add_rules(command);
  command.footer("Example: loopwarden outcome FIC101 --found stiction --note \"packing tight\"");
}

}  // namespace loopwarden::workbench
