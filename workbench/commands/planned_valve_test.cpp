// SPDX-License-Identifier: Apache-2.0
#include "workbench/commands/planned_valve_test.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "daemon/protocol/ask.hpp"
#include "daemon/protocol/planned_test/judged_test.hpp"
#include "model/effects/catalogue.hpp"
#include "record/record_csv.hpp"
#include "workbench/command_line/background.hpp"
#include "workbench/command_line/frame.hpp"
#include "workbench/commands/made_test.hpp"
#include "workbench/files/model_file.hpp"
#include "workbench/files/output_files.hpp"
#include "daemon/protocol/planned_test/test_plan_file.hpp"
#include "daemon/protocol/planned_test/planned_test.hpp"
#include "workbench/live/terminal.hpp"
#include "workbench/report/chart.hpp"
#include "workbench/setup/terminal_person.hpp"
#include "workbench/survey/test_log.hpp"
#include "workbench/text/json_number.hpp"
#include "workbench/text/posterior_bars.hpp"

namespace loopwarden::workbench {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using protocol::Decision;
using protocol::decision_of;
using protocol::names_of;
using protocol::PlannedExplanation;
using protocol::TestPlanFile;
using protocol::TestRecord;

struct TestOutcome {
  TestPlanFile plan;
  std::string target;
  TestRecord record;
  std::string ended_early;
  protocol::Swing swing;
  protocol::JudgedTest test;
  std::string ended;  // UTC
};

std::string seconds_text(double seconds) {
  return seconds < 120.0 ? fmt::format("{:.0f} s", seconds)
                         : fmt::format("{:.1f} min", seconds / 60.0);
}

std::string move_text(const TestPlanFile& plan, const std::string& unit) {
  const bool manual = estimator::in_manual(plan.move.kind);
  return fmt::format("{} by {:.4g} {} from {:.5g}, {} ({}), and back",
                     manual ? "In manual, the output moves" : "In automatic, SP moves",
                     plan.move.size, unit, plan.from,
                     seconds_text(estimator::duration_s(plan.move)),
                     estimator::to_text(plan.move.kind));
}

// --- consent ---

// Prints what will happen, and asks for the tag. Returns whether the person agrees.
bool agreed(setup::TerminalPerson& person, const protocol::LoopStatus& loop,
            const TestPlanFile& plan) {
  const bool manual = estimator::in_manual(plan.move.kind);
  person.say(fmt::format(
      "{}: {}.\n"
      "Expected: PV moves by at most {:.3g} {}, CO by {:.3g} {}.\n"
      "The test ends at once if PV leaves {:.4g} to {:.4g} or CO {:.4g} to {:.4g}, at a process\n"
      "alarm or fault, or if any key is pressed. The loop then returns to {}.\n"
      "It decides with probability {:.2f} rightly and with {:.2f} wrongly:",
      loop.name, move_text(plan, manual ? loop.co_unit : loop.pv_unit), plan.pv_swing, loop.pv_unit,
      plan.output_swing, loop.co_unit, plan.pv_limits[0], plan.pv_limits[1], plan.co_limits[0],
      plan.co_limits[1], manual ? "its output, mode and set point" : "its set point, in automatic",
      plan.probability_right, plan.probability_wrong));
  for (const PlannedExplanation& e : plan.explanations) {
    const effects::Descriptor* info =
        e.effects.empty() ? nullptr : effects::find_effect(e.effects.front());
    person.say(fmt::format("  {} ({:.2f} now): {}", title_of(e.effects), e.probability,
                           info != nullptr ? info->remedy : "No repair is needed."));
  }
  person.say("  undecided: The loop stays as it is. Run `gap` again with more data.");
  return person.line(fmt::format("Type {} to move the valve, or press Enter to leave: ",
                                 loop.name)) == loop.name;
}

std::string watch_key(setup::TerminalPerson& person, const protocol::TestProgress& now,
                      double duration_s, double& shown_s) {
  if (now.time_s >= shown_s) {
    person.say(fmt::format("{:>6.0f} s of {:.0f} s   SP {:.5g}   PV {:.5g}   CO {:.5g}", now.time_s,
                           duration_s, now.sp, now.pv, now.co));
    shown_s = now.time_s + std::max(5.0, duration_s / 20.0);
  }
  if (interrupted()) return "interrupted";
  return person.key(std::chrono::milliseconds(0)) ? "a key was pressed" : "";
}

void carry_out_live(const PlannedTestOptions& options, TestOutcome& outcome) {
  DaemonClient daemon(options.socket);
  const protocol::LoopStatus loop = protocol::loop_of_daemon(daemon, outcome.target);
  if (const std::string why = protocol::why_no_test(daemon, loop, outcome.plan); !why.empty()) {
    fail(kExitTryAgain, "{}: no test: {}", loop.name, why);
  }
  outcome.plan.loop = loop.name;
  setup::TerminalPerson person;
  if (!person.has_keys()) {
    fail(kExitUsage, "{}: a live test needs a terminal with an operator", loop.name);
  }
  if (!agreed(person, loop, outcome.plan)) fail(kExitTryAgain, "{}: no test", loop.name);
  // The person took time to read.
  if (const std::string why =
          protocol::why_no_test(daemon, protocol::loop_of_daemon(daemon, loop.name), outcome.plan);
      !why.empty()) {
    fail(kExitTryAgain, "{}: no test: {}", loop.name, why);
  }
  watch_interrupts();
  person.watch_keys(true);
  double shown_s = 0.0;
  protocol::CarriedOut done =
      protocol::carry_out(daemon, outcome.plan, {}, [&](const protocol::TestProgress& now) {
        return watch_key(person, now, estimator::duration_s(outcome.plan.move), shown_s);
      });
  person.watch_keys(false);
  outcome.record = std::move(done.record);
  outcome.ended_early = std::move(done.ended_early);
  const bool restored = protocol::wait_released(daemon, loop.name, [] { return false; });
  person.say(restored ? loop.name + ": released, as before the test"
                      : loop.name + ": the daemon has not restored it yet. See `loopwarden top`.");
}

// --- results ---

std::string sentence(const TestOutcome& outcome) {
  return outcome.ended_early.empty() ? protocol::sentence_of(outcome.plan, outcome.test)
                                     : "The test ended early: " + outcome.ended_early + ".";
}

json as_json(const TestOutcome& o) {
  json explanations = json::array();
  for (std::size_t i = 0; i < o.plan.explanations.size(); ++i) {
    const PlannedExplanation& e = o.plan.explanations[i];
    explanations.push_back(
        {{"effects", e.effects},
         {"probability_before", e.probability},
         {"probability_after", o.test.judged ? json(o.test.judged->probability[i]) : json()}});
  }
  const std::string name = decision_of(o.plan, o.test).name;
  return {{"loop", o.target},
          {"move", estimator::to_text(o.plan.move.kind)},
          {"size", o.plan.move.size},
          {"planned_at", o.plan.planned_at},
          {"done", o.ended_early.empty()},
          {"ended_utc", o.ended},
          {"ended_early", o.ended_early.empty() ? json() : json(o.ended_early)},
          {"explanations", std::move(explanations)},
          {"competing", names_of(o.plan)},
          {"probability_of_others", o.test.judged ? json(o.test.judged->other) : json()},
          {"decided", name.empty() ? json() : json(name)},
          {"probability", decision_of(o.plan, o.test).probability},
          {"predicted",
           {{"probability_right", o.plan.probability_right},
            {"probability_wrong", o.plan.probability_wrong},
            {"pv_swing", o.plan.pv_swing},
            {"output_swing", o.plan.output_swing}}},
          {"happened", {{"pv_swing", o.swing.pv}, {"output_swing", o.swing.co}}},
          {"sentence", sentence(o)}};
}

void print_text(const TestOutcome& o) {
  fmt::print("{}\n", sentence(o));
  fmt::print("{:<24}{:>12}{:>12}\n", "", "predicted", "happened");
  fmt::print("{:<24}{:>12.3g}{:>12.3g}\n", "PV moved by, PV units", o.plan.pv_swing, o.swing.pv);
  fmt::print("{:<24}{:>12.3g}{:>12.3g}\n", "CO moved by, CO units", o.plan.output_swing,
             o.swing.co);
  fmt::print("{:<24}{:>12.2f}{:>12}\n", "decides", o.plan.probability_right,
             decision_of(o.plan, o.test).name.empty() ? "no" : "yes");
  if (!o.test.judged) return;
  for (std::size_t i = 0; i < o.plan.explanations.size(); ++i) {
    fmt::print("{:<24}{:>12.2f}{:>12.2f}\n", title_of(o.plan.explanations[i].effects),
               o.plan.explanations[i].probability, o.test.judged->probability[i]);
  }
  if (o.test.judged->other >= 0.01)
    fmt::print("{:<24}{:>12}{:>12.2f}\n", "others", "", o.test.judged->other);
}

std::string page(const TestOutcome& o) {
  constexpr std::array<const char*, 3> kColours{palette::kBlue, palette::kOrange, palette::kGreen};
  Chart chart{.title = "PV, and 90 % of what each explanation predicts",
              .x_label = "s",
              .y_label = "PV units",
              .width = 900.0};
  for (std::size_t i = 0; i < o.plan.explanations.size(); ++i) {
    std::vector<double> time, low, high;
    for (const auto& [t, lowest, highest] : o.plan.explanations[i].pv) {
      time.push_back(t);
      low.push_back(lowest);
      high.push_back(highest);
    }
    const char* const colour = kColours[i % kColours.size()];
    chart.lines.push_back({title_of(o.plan.explanations[i].effects), colour, time, low, true});
    chart.lines.push_back({"", colour, time, high, true});
  }
  chart.lines.push_back({"SP", palette::kGrey, o.record.time_s, o.record.sp});
  chart.lines.push_back({"PV", palette::kInk, o.record.time_s, o.record.pv});
  const Chart output{.title = "CO and valve position",
                     .x_label = "s",
                     .y_label = "CO units",
                     .lines = {{"CO", palette::kGrey, o.record.time_s, o.record.co, true},
                               {"position", palette::kBlue, o.record.time_s, o.record.stem}},
                     .width = 900.0};
  std::string body = fmt::format(
      "<p>{}</p>\n<table><tr><th></th><th>predicted</th><th>happened"
      "</th></tr>\n",
      escaped(sentence(o)));
  const auto row = [&](const std::string& name, const std::string& before,
                       const std::string& after) {
    body +=
        fmt::format("<tr><td>{}</td><td>{}</td><td>{}</td></tr>\n", escaped(name), before, after);
  };
  row("PV moved by, PV units", fmt::format("{:.3g}", o.plan.pv_swing),
      fmt::format("{:.3g}", o.swing.pv));
  row("CO moved by, CO units", fmt::format("{:.3g}", o.plan.output_swing),
      fmt::format("{:.3g}", o.swing.co));
  row("probability of a decision", fmt::format("{:.2f}", o.plan.probability_right),
      decision_of(o.plan, o.test).name.empty() ? "not decided" : "decided");
  for (std::size_t i = 0; i < o.plan.explanations.size(); ++i) {
    row("probability: " + title_of(o.plan.explanations[i].effects),
        fmt::format("{:.2f}", o.plan.explanations[i].probability),
        o.test.judged ? fmt::format("{:.2f}", o.test.judged->probability[i]) : "-");
  }
  body += fmt::format("</table>\n<figure>{}</figure>\n<figure>{}</figure>\n", chart_svg(chart),
                      chart_svg(output));
  return html_page("Test of " + o.target, body);
}

record::Record csv_of(const TestRecord& test) {
  record::Record out;
  out.period_s = test.period_s;
  out.time_s = test.time_s;
  out.sp = test.sp;
  out.pv = test.pv;
  out.co = test.co;
  const bool position =
      std::any_of(test.stem.begin(), test.stem.end(), [](double v) { return std::isfinite(v); });
  if (position) out.stem = test.stem;
  return out;
}

// Keeps the result in the daemon's journal and next to the survey.
void keep(const PlannedTestOptions& options, const TestOutcome& o) {
  const Decision decision = decision_of(o.plan, o.test);
  const KeptTest test{.ended = o.ended,
                      .loop = o.target,
                      .explanations = names_of(o.plan),
                      .predicted = o.plan.probability_right,
                      .decided = decision.name,
                      .probability = decision.probability};
  if (!options.survey.empty()) keep_test_of_survey(options.survey, test);
  if (!options.live) return;
  DaemonClient daemon(options.socket);
  protocol::ask(daemon, protocol::TestResultRequest{.loop = o.target,
                                                    .explanations = test.explanations,
                                                    .decided = test.decided,
                                                    .predicted = test.predicted,
                                                    .probability = test.probability});
}

// --- a move that a person made ---

constexpr const char* kAnotherMove = "another_move";
constexpr const char* kLookedTo = "looked_to";

std::string sentence(const estimator::MadeMove& move, const std::string& unit) {
  switch (move.state) {
    case estimator::MadeMove::State::under_way: return "The move is under way.";
    case estimator::MadeMove::State::other:
      return fmt::format("Another move than proposed was seen, by {:+.3g} {} from {:.5g}: {}.",
                         move.size, unit, move.from, estimator::to_text(move.difference));
    default: return "The move was not seen yet.";
  }
}

// Result of an earlier search for the same plan; null: none.
json earlier_search(const fs::path& file, const TestPlanFile& plan) {
  std::ifstream stream(file);
  const json before = json::parse(stream, nullptr, false);
  const bool same = before.is_object() && before.value(kLookedTo, std::int64_t{0}) != 0 &&
                    before.value("planned_at", std::int64_t{0}) == plan.planned_at;
  return same ? before : json();
}

// Returns the result of the search if the move was not made as planned. Otherwise it is null and
// the outcome has the record of the move.
json search_move(const PlannedTestOptions& options, TestOutcome& outcome, OutputFiles& files) {
  const TestPlanFile& plan = outcome.plan;
  const plant::LoopModel model =
      load_model((fs::path(options.plan).parent_path() / plan.model).string());
  const double rest_s = estimator::kRest * std::max(plant::answer_s(model), model.sample_time_s);
  const json before = earlier_search(fs::path(options.out) / "test.json", plan);
  // A move can begin before the end of the earlier search.
  const auto again_s =
      static_cast<std::int64_t>(rest_s + 2.0 * estimator::duration_s(plan.move)) + 60;
  const std::int64_t from_s =
      before.is_null()
          ? plan.planned_at
          : std::max(plan.planned_at, before.at(kLookedTo).get<std::int64_t>() - again_s);
  const auto now_s = static_cast<std::int64_t>(std::time(nullptr));
  MadeTest made = find_made_test(
      plan,
      read_later_records(options.record, from_s, plan.planned_at + protocol::kSlipValid_s, files),
      rest_s);
  if (made.move.state == estimator::MadeMove::State::made) {
    outcome.record = std::move(made.record);
    return nullptr;
  }
  const std::string text =
      sentence(made.move, estimator::in_manual(plan.move.kind) ? "CO units" : "PV units");
  constexpr std::int64_t kOnDisk_s = 120;  // until the newest rows are on the disk
  const bool expired = now_s > plan.planned_at + protocol::kSlipValid_s + kOnDisk_s;
  json another = made.move.state == estimator::MadeMove::State::other ? json(text) : json();
  if (another.is_null() && !before.is_null()) another = before.at(kAnotherMove);
  return {{"loop", outcome.target}, {"planned_at", plan.planned_at},
          {"done", false},          {"expired", expired},
          {kLookedTo, now_s},       {kAnotherMove, another},
          {"sentence", text}};
}

// Returns the exit code if the test ends here.
std::optional<int> take_made_move(const PlannedTestOptions& options, TestOutcome& outcome) {
  OutputFiles files({options.plan, options.record});
  files.make_folder(options.out);
  const json result = search_move(options, outcome, files);
  if (result.is_null()) return std::nullopt;
  files.add(fs::path(options.out) / "test.json", result.dump(2) + "\n");
  files.commit();
  if (options.json) {
    show_json(result);
  } else if (!in_background()) {
    fmt::print("{}\n", result.at("sentence").get<std::string>());
  }
  return in_background() ? kExitOk : kExitTryAgain;
}

}  // namespace

int run_planned_test(const PlannedTestOptions& options) {
  if (options.out.empty()) require("valve-test --plan: --out");
  TestOutcome outcome;
  outcome.plan = usable(protocol::read_test_plan(options.plan));
  const fs::path folder = fs::path(options.plan).parent_path();
  outcome.target = options.target;
  if (outcome.target.empty() && (options.live || !options.record.empty())) {
    outcome.target = outcome.plan.loop;
  }
  if (outcome.target.empty()) {
    if (options.live) require("valve-test --plan --live: the tag of the loop");
    outcome.target = (folder / outcome.plan.model).string();
  }
  const fs::path out(options.out);
  if (!options.record.empty()) {
    if (const auto code = take_made_move(options, outcome)) return *code;
  }
  OutputFiles files({options.plan, (folder / outcome.plan.record).string()});
  files.make_folder(out);
  for (const char* name : {"test.csv", "test.json", "report.html"}) files.expect(out / name);
  if (options.live) {
    carry_out_live(options, outcome);
  } else if (options.record.empty()) {
    plant::LoopModel model = load_model(outcome.target);
    // Faults act from the start and at full severity, because a test does not wait for them.
    for (plant::ScheduledFault& fault : model.scenario.faults) fault.schedule = {};
    outcome.record = protocol::simulate_test(model, outcome.plan);
  }
  outcome.ended = protocol::utc_time_text(static_cast<std::int64_t>(std::time(nullptr)));
  outcome.swing = protocol::swing_of(outcome.record);
  if (outcome.ended_early.empty()) {
    outcome.test = protocol::judge_test(
        outcome.plan, outcome.record, record::read_record(folder / outcome.plan.record),
        load_model((folder / outcome.plan.model).string()), on_threads(threads(0)));
  }
  const json result = as_json(outcome);
  if (!outcome.record.pv.empty()) {
    record::write_record(csv_of(outcome.record), files.stage(out / "test.csv"));
  } else {
    files.add(out / "test.csv", "time,pv\n");
  }
  files.add(out / "test.json", result.dump(2) + "\n");
  files.add(out / "report.html", page(outcome));
  files.commit();
  if (outcome.ended_early.empty()) keep(options, outcome);
  if (options.json) {
    show_json(result);
  } else if (!in_background()) {
    print_text(outcome);
  }
  if (!outcome.ended_early.empty()) return kExitTryAgain;
  return kExitOk;
}

}  // namespace loopwarden::workbench
