// SPDX-License-Identifier: Apache-2.0
// loopwarden survey: ranks all loops of a plant.
#include "workbench/command_line/frame.hpp"
#include "workbench/survey/changes.hpp"
#include "workbench/survey/costs.hpp"
#include "workbench/survey/outcomes.hpp"
#include "workbench/survey/survey.hpp"
#include "workbench/survey/survey_page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "base/text.hpp"
#include "config/config_reader.hpp"
#include "workbench/command_line/share.hpp"
#include "workbench/commands/subcommands.hpp"
#include "workbench/files/output_files.hpp"
#include "workbench/records/record_input.hpp"
#include "workbench/records/recorder_input.hpp"

namespace loopwarden::workbench {
namespace {

namespace fs = std::filesystem;

struct SurveyCommand {
  std::vector<std::string> paths;
  std::vector<std::string> merge;
  std::string out;
  std::string shard;
  std::string kind;
  RecordInput input;
  RecorderInput recorder;  // in place of paths
  double window_h = 8.0;
  std::vector<double> co_range;
  unsigned jobs = 0;
  bool json = false;
  std::string outcomes;
  std::string against;
  std::string area;
  std::string weights;
  std::string costs;
  std::string loops;  // configuration folder of the daemon
};

constexpr std::size_t kLinesShown = 20;

// Prints each problem once, with its file.
void print_failed(const nlohmann::json& failed) {
  std::set<std::string> said;
  for (const auto& problem : failed) {
    const auto file = problem.at("file").get<std::string>();
    std::string why = problem.at("why").get<std::string>();
    if (!why.starts_with(file)) {
      why = fmt::format("{}: {}: {}", file, problem.value("loop", "loop"), why);
    }
    if (said.insert(why).second) {
      fmt::print(stderr, "{}: {}\n", is_skipped(problem) ? "skipped" : "failed", why);
    }
  }
}

// Returns 65 if a file or loop could not be read, even though all others were judged.
int exit_code_of(const nlohmann::json& failed) {
  return std::all_of(failed.begin(), failed.end(), is_skipped) ? kExitOk : kExitData;
}

// Returns "29 files: 27 read, 2 could not be read; 12 loops: 8 judged, 3 from an earlier run, 1
// could not be read; 4 files skipped". The parts of files and of loops add up to their totals. The
// last part is additional.
std::string count_text(const SurveyCount& count, const nlohmann::json& failed) {
  const auto names_of = [&](const char* lost, const char* key) {
    std::set<std::string> names;
    for (const auto& problem : failed) {
      if (problem.value("lost", "loop") == lost) names.insert(problem.at(key).get<std::string>());
    }
    return names.size();
  };
  const auto of = [](std::size_t number, const char* what) {
    return fmt::format("{} {}{}", number, what, number == 1 ? "" : "s");
  };
  std::string text = fmt::format(
      "{}: {} read, {} could not be read; {}: {} judged, {} from an earlier run, {} could not be "
      "read",
      of(count.files, "file"), count.files - count.files_lost, count.files_lost,
      of(count.loops, "loop"), count.judged, count.resumed,
      count.loops - count.judged - count.resumed);
  const auto besides = [&](std::size_t number, const char* one, const char* what) {
    if (number > 0) text += fmt::format("; {} {}", of(number, one), what);
  };
  besides(names_of("part", "loop"), "loop", "judged without some of the files");
  besides(names_of("signals", "loop"), "loop", "without PV or CO");
  besides(count.passed_over, "file", "skipped");
  return text;
}

struct ListRow {
  std::string order;
  const nlohmann::json* loop;
  std::string next;
};

// Returns the loops with an order in the sequence of worklist.csv, then all others by rank.
std::vector<ListRow> list_rows(const nlohmann::json& survey) {
  std::map<std::string, const nlohmann::json*> left;
  for (const auto& loop : survey.at("loops")) left[loop.at("tag").get<std::string>()] = &loop;
  std::vector<ListRow> rows;
  for (const auto& order : survey.value("worklist", nlohmann::json::array())) {
    const auto loop = left.extract(order.at("source_tag").get<std::string>());
    if (loop.empty()) continue;
    rows.push_back({std::to_string(order.at("order").get<std::size_t>()), loop.mapped(),
                    order.at("action").get<std::string>()});
  }
  for (const auto& loop : survey.at("loops")) {
    if (left.count(loop.at("tag").get<std::string>()) == 0) continue;
    rows.push_back({"-", &loop, loop.at("next").at("what").get<std::string>()});
  }
  return rows;
}

// Prints the tags of --loops that match no loop of the survey.
void print_unmatched(const std::string& file, const LoopWeights& weights,
                     const nlohmann::json& survey) {
  std::set<std::string> known;
  for (const auto& loop : survey.at("loops")) {
    known.insert(loop.at("tag").get<std::string>());
    known.insert(loop.at("shown").get<std::string>());
  }
  for (const auto& [tag, weight] : weights) {
    if (known.count(tag) > 0) continue;
    fmt::print(stderr, "{}:{}: {} matches no loop\n", file, weight.line, base::in_quotes(tag));
  }
}

void print_survey(const nlohmann::json& survey, const fs::path& out, bool as_json) {
  if (as_json) {
    show_json(survey);
    return;
  }
  const auto& loops = survey.at("loops");
  std::vector<std::pair<std::string, std::size_t>> steps;  // in the order of the ranks
  for (const auto& loop : loops) {
    const auto what = loop.at("next").at("what").get<std::string>();
    const auto step = std::find_if(steps.begin(), steps.end(),
                                   [&](const auto& known) { return known.first == what; });
    if (step == steps.end()) {
      steps.emplace_back(what, 1);
    } else {
      ++step->second;
    }
  }
  std::string counts;
  for (const auto& [step, count] : steps) counts += fmt::format(", {} {}", count, step);
  fmt::print("{} loop{}{}\n", loops.size(), loops.size() == 1 ? "" : "s", counts);
  fmt::print("{:>5}  {:<28} {:<16} {:>7} {:>10} {:>6}  {}\n", "order", "loop", "verdict", "valve %",
             "period s", "group", "next");
  const std::vector<ListRow> rows = list_rows(survey);
  for (std::size_t k = 0; k < std::min(kLinesShown, rows.size()); ++k) {
    const auto& loop = *rows[k].loop;
    const auto number = [&](const char* key, double factor) {
      return loop.at(key).is_number() ? fmt::format("{:.4g}", factor * loop.at(key).get<double>())
                                      : std::string("-");
    };
    std::string verdict = loop.at("verdict").get<std::string>();
    if (verdict == "valve_effect") verdict = loop.at("effects").at(0).at("name").get<std::string>();
    if (verdict == "other_cause") verdict = loop.at("cause").get<std::string>();
    fmt::print("{:>5}  {:<28} {:<16} {:>7} {:>10} {:>6}  {}\n", rows[k].order,
               loop.value("shown", loop.at("tag").get<std::string>()), verdict,
               loop.at("probability").is_number()
                   ? fmt::format("{:.0f}", 100.0 * loop.at("probability").get<double>())
                   : "-",
               number("period_s", 1.0), number("group", 1.0), rows[k].next);
  }
  if (loops.size() > kLinesShown)
    fmt::print("  ... {} more in survey.html\n", loops.size() - kLinesShown);
  if (const std::string found = precision_text(survey.value("outcomes", nlohmann::json(nullptr)));
      !found.empty()) {
    fmt::print("{}\n", found);
  }
  const auto orders = survey.value("worklist", nlohmann::json::array());
  fmt::print("{} order{} in {}\n{}\n", orders.size(), orders.size() == 1 ? "" : "s",
             (out / "worklist.csv").string(), (out / "survey.html").string());
}

std::optional<record::TagPattern> area_in(const SurveyCommand& options) {
  if (options.area.empty()) return std::nullopt;
  try {
    const record::TagPattern pattern(options.area);
    if (pattern.wildcards() > 0) return pattern;
  } catch (const std::invalid_argument& e) {
    fail(kExitUsage, "--area: {}", e.what());
  }
  fail(kExitUsage, "--area: the area is the text at the first of *, ? and [...], which {} lacks",
       base::in_quotes(options.area));
}

// Adds the areas and masters of the daemon's loop files to the texts of the site.
void add_loop_files(const std::string& folder, std::vector<record::TagText>& tags) {
  const auto read = config::read_configuration(folder);
  if (!read) fail(kExitConfiguration, "{}", config::to_text(read.diagnostics));
  for (const config::LoopConfig& loop : read.value->loops) {
    if (loop.area.empty() && loop.master.empty()) continue;
    for (const char* before : {"", "*/", "*]"}) {
      tags.push_back({.pattern = record::TagPattern(before + loop.name),
                      .area = loop.area,
                      .master = loop.master});
    }
  }
}

// Reads everything that the report needs before the long work.
SurveyReport report_settings(const SurveyCommand& options) {
  SurveyReport how{.outcomes = options.outcomes,
                   .site = {.tags = options.input.options().tags, .area = area_in(options)}};
  if (!options.loops.empty()) add_loop_files(options.loops, how.site.tags);
  if (!options.weights.empty()) how.weights = read_loop_weights(options.weights);
  if (!options.costs.empty()) how.costs = read_costs_file(options.costs);
  return how;
}

// Reads the earlier survey of --against before the long work, because it may be in the folder of
// the new one.
class Against {
 public:
  explicit Against(const SurveyCommand& options)
      : json_(options.json), before_name_(options.against) {
    if (options.against.empty()) return;
    before_ = read_survey(options.against);
    how_.area = area_in(options);
    if (!options.weights.empty()) how_.weights = read_loop_weights(options.weights);
  }

  void tell(const nlohmann::json& survey, const fs::path& out) const {
    if (!before_) return;
    const nlohmann::json changes = compared(survey);
    OutputFiles files;
    files.add(out / "changes.html", changes_page(changes));
    files.add(out / "changes.json", changes.dump(1) + "\n");
    files.commit();
    if (json_) return;
    fmt::print("\n{}{}\n", changes_text(changes), (out / "changes.html").string());
  }

 private:
  nlohmann::json compared(const nlohmann::json& survey) const {
    try {
      return compare_surveys(survey, *before_, how_);
    } catch (const nlohmann::json::exception& e) {
      fail(kExitData, "{}: cannot be compared: {}", before_name_, e.what());
    }
  }

  bool json_;
  std::string before_name_;
  std::optional<nlohmann::json> before_;
  Comparing how_;
};

// Takes the recorder's longest stretch of a loop in place of exports, under the loop's name.
void take_from_recorder(SurveyCommand& options) {
  OutputFiles files;
  const fs::path folder = fs::path(options.out) / "records";
  files.make_folder(folder);
  const std::string& tag = options.input.loop();
  const Recorded recorded = options.recorder.take(tag, folder);
  const fs::path record = folder / (tag + ".csv");
  fs::rename(recorded.longest().path, record);
  files.commit();
  options.paths = {record.string()};
  if (options.co_range.empty()) {
    options.co_range.assign(recorded.loop.co_range.begin(), recorded.loop.co_range.end());
  }
}

// Returns the result of a survey of one loop as one sentence.
std::string sentence_of(const nlohmann::json& survey) {
  if (survey.at("loops").empty()) {
    fail(kExitData, "{}", survey.at("failed").at(0).at("why").get<std::string>());
  }
  const nlohmann::json& loop = survey.at("loops").at(0);
  return fmt::format("{}; next: {}", surveyed_verdict(loop),
                     loop.at("next").at("what").get<std::string>());
}

int run_survey(const SurveyCommand& given) {
  SurveyCommand options = given;
  const RecorderInput& recorder = options.recorder;
  if (!options.input.loop().empty() && !recorder.given()) {
    fail(kExitUsage, "--loop: add --last or --since");
  }
  const bool files = !options.paths.empty() || !options.merge.empty();
  if ((recorder.given() || recorder.background()) && recorder.asked(files, options.input.loop())) {
    take_from_recorder(options);
  }
  const bool as_it_is = options.merge.empty() && options.paths.empty();
  if ((as_it_is && options.against.empty()) || (!options.merge.empty() && !options.paths.empty())) {
    fail(kExitUsage, "survey: exports or folders of them, or --merge with the folders of shares");
  }
  const Against against(options);
  const fs::path out(options.out);
  if (as_it_is) {
    const nlohmann::json survey = read_survey(out);
    if (options.json) show_json(survey);
    against.tell(survey, out);
    return kExitOk;
  }
  const SurveyReport report = report_settings(options);
  if (!options.merge.empty()) {
    const nlohmann::json survey =
        write_survey({options.merge.begin(), options.merge.end()}, out, report);
    if (!options.json) print_failed(survey.at("failed"));
    print_unmatched(options.weights, report.weights, survey);
    print_survey(survey, out, options.json);
    against.tell(survey, out);
    return exit_code_of(survey.at("failed"));
  }
  SurveyRun run{.paths = options.paths,
                .out = out,
                .import = options.input.options(),
                .settings = {.window_s = 3600.0 * options.window_h,
                             .co_range = options.co_range,
                             .kind = options.kind},
                .jobs = threads(options.jobs)};
  if (!options.co_range.empty() && !(options.co_range[0] < options.co_range[1])) {
    fail(kExitUsage, "--co-range: the upper end must be above the lower one");
  }
  run.share = share_from(options.shard);
  const SurveyCount count = judge_all(run);
  fmt::print(stderr, "{}", count.said);
  fmt::print(stderr, "{}", count.rules);
  if (count.loops == 0 && run.share.of == 1) {
    print_failed(count.failed);
    fmt::print(stderr, "{}\n", count_text(count, count.failed));
    fail(count.exit_code,
         "no loop with PV and CO was found; 'loopwarden import --list' shows what was, --map "
         "pv=NAME,co=NAME names the columns or tags of one");
  }
  const nlohmann::json survey = write_survey({out}, out, report);
  if (options.recorder.background()) {
    fmt::print("{}\n", sentence_of(survey));
    return exit_code_of(survey.at("failed"));
  }
  if (!options.json) print_failed(survey.at("failed"));
  if (run.share.of == 1) print_unmatched(options.weights, report.weights, survey);
  fmt::print(stderr, "{}\n", count_text(count, survey.at("failed")));
  print_survey(survey, out, options.json);
  against.tell(survey, out);
  return exit_code_of(survey.at("failed"));
}

}  // namespace

void add_survey(Program& program) {
  auto [command, o] = program.command(
      "survey", "Rank all loops of a plant by need of attention, with the next step for each",
      run_survey);
  command.option("path", o.paths,
                 "exports with any number of loops, .xlsx, .zip and folders of them");
  command.required(
      "--out", o.out,
      "folder for worklist.csv, survey.html, survey.csv, survey.json; an earlier run in it is "
      "continued");
  command.setting("--window", o.window_h,
                  "hours per row of figures; the verdicts do not depend on it",
                  between(0.01, 10000.0));
  const Option shard = command.option("--shard", o.shard, "k/N: the k-th of N shares of the loops");
  command.option("--merge", o.merge, "folders of shares to join");
  command
      .option("--co-range", o.co_range,
              "lower and upper end of CO; default: --rules, or 0 100, 0 1 or 4 20 by the values")
      .takes(2);
  command.option("--kind", o.kind, "what the loops control; default: from their tags",
                 one_of({"flow", "pressure", "level", "temperature", "unknown"}));
  command.setting("--jobs", o.jobs, "threads; 0: one per core. The result does not depend on it");
  command.flag("--json", o.json, "print survey.json");
  command.option("--outcomes", o.outcomes,
                 "findings of technicians (loopwarden outcome); default: outcomes.csv in --out");
  command.option("--area", o.area,
                 "pattern of tags, such as U*-*: the area is the text at its first wildcard; "
                 "default: folders in the tag, the text before the function letters, or the number "
                 "without its last two digits");
  command.option("--loops", o.weights,
                 "CSV with the columns tag, criticality and cost_per_hour, which replaces the "
                 "assumed loss");
  command.option("--loop-files", o.loops,
                 "configuration folder of loopwardend, such as /etc/loopwardend: areas and masters "
                 "of the loops");
  command.option("--costs", o.costs,
                 "YAML with the costs from which minutes and savings are estimated "
                 "(docs/reference/worklist.md)");
  Command comparing = command.group("Against an earlier survey");
  Option against = comparing.option(
      "--against", o.against,
      "survey.json or folder of an earlier survey: writes new, worse, better and gone loops to "
      "changes.html and changes.json; without exports, compares the survey in --out");
  against.excludes(shard);
  o.recorder.add_options(command, "; the record is kept in the folder records of --out");
  o.input.add_options(command);
  o.input.add_rules(command);
  command.footer(
      "No model, no tuning, no configuration. Exit code 65: something could not be read; the rest "
      "was judged.\nExample: loopwarden survey exports/ --out survey");
}

}  // namespace loopwarden::workbench
