// SPDX-License-Identifier: Apache-2.0
// loopwarden explain: compares an alarm's newest minutes with the loop's twin, in the folder of its
// evidence. The daemon runs it in the background for every alarm of a loop with a twin.
#include "model/twin/explain.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>

#include "config/loop_model_writer.hpp"
#include "record/record_csv.hpp"
#include "workbench/command_line/background.hpp"
#include "workbench/command_line/frame.hpp"
#include "workbench/commands/subcommands.hpp"
#include "workbench/files/model_file.hpp"
#include "workbench/files/output_files.hpp"
#include "daemon/protocol/planned_test/test_plan_file.hpp"
#include "workbench/report/gap_report.hpp"
#include "workbench/report/next_test_section.hpp"
#include "workbench/text/explanation_json.hpp"
#include "workbench/text/next_test_text.hpp"

namespace loopwarden::workbench {
namespace {

namespace fs = std::filesystem;
using alarm::AlarmKind;
using nlohmann::json;

struct ExplainOptions {
  std::string folder;
  unsigned jobs = 0;
  bool background = false;
  bool json = false;
};

struct Raised {
  AlarmKind alarm = AlarmKind::model_gap;
  std::int64_t raised_ms = 0;
  std::string loop;
  bool elsewhere = true;  // has another controller; also if an older daemon did not report it
};

// Throws std::runtime_error if the folder holds no evidence.
Raised read_raised(const fs::path& folder) {
  const fs::path file = folder / "evidence.json";
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw std::runtime_error(file.string() + ": not there, or not to be read");
  try {
    const json about = json::parse(stream);
    const auto found =
        std::find_if(alarm::kValveAlarms.begin(), alarm::kValveAlarms.end(),
                     [&](AlarmKind kind) { return about.at("alarm") == alarm::to_text(kind); });
    if (found == alarm::kValveAlarms.end()) throw std::runtime_error("its alarm is not known");
    return {*found, about.at("raised_ms").get<std::int64_t>(), about.at("loop").get<std::string>(),
            about.value("control", "elsewhere") == "elsewhere"};
  } catch (const std::exception& e) {
    throw std::runtime_error(fmt::format("{}: {}", file.string(), e.what()));
  }
}

void print_result(const json& e, const std::string& folder) {
  fmt::print("{}\n", e.at("sentence").get<std::string>());
  if (const json& first = e.at("first"); !first.is_null()) {
    fmt::print("Action: {}\n", first.at("remedy").get<std::string>());
  }
  if (!e.at("next_test").is_null()) {
    fmt::print("{}\n", e.at("next_test").at("text").get<std::string>());
  }
  if (!e.at("final_name").is_null()) {
    fmt::print("{} is {}\n", e.at("alarm").get<std::string>(),
               e.at("final_name").get<std::string>());
  } else {
    fmt::print("{} {}\n",
               e.at("agrees").get<bool>() ? "agrees with" : "does not agree with, but leaves,",
               e.at("alarm").get<std::string>());
  }
  fmt::print("{0}/explanation.json, {0}/report.html\n", folder);
}

// Writes the plan of the test, with the record since the change, and for a watched loop a slip for
// its operator, with the time until which it is valid in `proposed`. Returns how to carry it out.
std::string write_next_test(const twin::Explanation& explanation, const record::Record& record,
                            const Raised& raised, const fs::path& folder, OutputFiles& files,
                            json& proposed) {
  constexpr const char* kRecord = "next_test.record.csv";
  const gap::NextTest& test = *explanation.result.next_test;
  TestPlanFile plan = plan_file(explanation.result);
  plan.loop = raised.loop;
  plan.planned_at = std::chrono::duration_cast<std::chrono::seconds>(
                        std::chrono::system_clock::now().time_since_epoch())
                        .count();
  plan.model = "twin.yaml";
  plan.record = kRecord;
  record::Record since;
  static_cast<numeric::LoopRecord&>(since) = record.part(explanation.at, explanation.stretch.end);
  for (std::size_t k = 0; k < since.size(); ++k) since.time_s.push_back(since.seconds_at(k));
  record::write_record(since, files.stage(folder / kRecord));
  files.add(folder / "next_test.yaml",
            write_test_plan(plan, "Proposed by loopwarden explain. " + test_sentence(test.plan)));
  if (!raised.elsewhere) {
    return fmt::format("Command: loopwarden valve-test {} --plan {} --live", raised.loop,
                       (folder / "next_test.yaml").string());
  }
  const std::int64_t until = plan.planned_at + protocol::kSlipValid_s;
  proposed["valid_until_ms"] = 1000 * until;
  proposed["planned_at"] = plan.planned_at;
  files.add(folder / "slip.html",
            test_slip_html(raised.loop, test, protocol::utc_time_text(until)));
  return fmt::format("For the operator, until {}: {}", protocol::utc_time_text(until),
                     (folder / "slip.html").string());
}

// Returns the test that an earlier explanation in this folder proposes for a watched loop, if it is
// done or its slip is still valid; null: none. The operator may have its slip on paper.
json kept_test(const fs::path& folder, bool proposes) {
  const auto object_in = [](const fs::path& file) {
    std::ifstream stream(file, std::ios::binary);
    const json found = json::parse(stream, nullptr, false);
    return found.is_object() ? found : json::object();
  };
  const json explained = object_in(folder / "explanation.json");
  const json test = explained.value("next_test", json());
  if (!test.is_object() || !test.contains("valid_until_ms")) return nullptr;
  const json result = object_in(folder / "test" / "test.json");
  const bool done = result.value("done", false) &&
                    result.value("planned_at", json()) == test.value("planned_at", json());
  const bool valid = std::chrono::system_clock::now() <
                     std::chrono::system_clock::time_point(
                         std::chrono::milliseconds(test.at("valid_until_ms").get<std::int64_t>()));
  return done || (proposes && valid) ? test : nullptr;
}

int run_explain(const ExplainOptions& options) {
  if (options.background) work_in_background();
  const auto begin = std::chrono::steady_clock::now();
  const fs::path folder(options.folder);
  const fs::path minutes = folder / "minutes.csv";
  const fs::path twin_file = folder / "twin.yaml";
  if (!fs::exists(twin_file)) {
    fail(kExitData, "{}: no twin.yaml: alarms of loops with a twin have one", options.folder);
  }
  const plant::LoopModel twin = load_model(twin_file.string());
  OutputFiles files({minutes.string(), twin_file.string()});
  try {
    const Raised raised = read_raised(folder);
    const fs::path record_file = fs::exists(minutes) ? minutes : folder / "record.csv";
    const record::Record record = record::read_record(record_file);
    if (record.co.empty()) {
      fail(kExitData, "{}: no column 'co'", record_file.string());
    }
    // minutes.csv counts its time from the alarm. A plain record ends with the alarm.
    const double half_s = 0.5 * record.period_s;
    const auto at = std::lower_bound(record.time_s.begin(), record.time_s.end(), -half_s);
    const bool from_alarm = record_file == minutes && at != record.time_s.end();
    const std::size_t alarm =
        from_alarm ? static_cast<std::size_t>(at - record.time_s.begin()) : record.size() - 1;
    const twin::Explanation explanation = twin::explain(
        record, twin, alarm, {.enough_s = twin::kMostSeen_s, .judge_controller = raised.elsewhere},
        on_threads(threads(options.jobs)));
    const std::optional<AlarmKind> name = twin::final_name(explanation, raised.alarm);
    const double first_s = record.time_s.front() - record.time_s[alarm];
    json out = explanation_json(explanation, name.value_or(raised.alarm), first_s, record.period_s);
    out["loop"] = raised.loop;
    out["alarm"] = alarm::to_text(raised.alarm);
    out["final_name"] = name ? json(alarm::to_text(*name)) : json();
    out["raised_ms"] = raised.raised_ms;
    out["ended_ms"] = std::chrono::duration_cast<std::chrono::milliseconds>(
                          std::chrono::system_clock::now().time_since_epoch())
                          .count();
    out["first"] = first_effect_json(explanation);
    out["version"] = LOOPWARDEN_VERSION;
    GapReportContext context{
        .record = record_file.string(),
        .model = twin_file.string(),
        .model_text = text_of(twin_file.string()),
        .corrected_text = explanation.usable() ? config::write_model(explanation.result.corrected,
                                                                     explanation.result.sentence)
                                               : std::string(),
        .out = options.folder,
        .seconds_of_work =
            std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count(),
        .version = LOOPWARDEN_VERSION};
    json& proposed = out["next_test"];
    if (json kept = kept_test(folder, !proposed.is_null()); !kept.is_null()) {
      proposed = std::move(kept);
    } else if (explanation.result.next_test) {
      proposed["text"] = proposed["text"].get<std::string>() + " " +
                         write_next_test(explanation, record, raised, folder, files, proposed);
    }
    files.add(folder / "report.html", gap_report_html(explanation.result, context));
    files.add(folder / "explanation.json", out.dump(2) + "\n");
    files.commit();
    if (proposed.is_null()) {  // a slip of an earlier explanation is withdrawn
      for (const char* stale : {"slip.html", "next_test.yaml"}) fs::remove(folder / stale);
    }
    if (options.json) {
      show_json(out);
    } else if (!options.background) {
      print_result(out, options.folder);
    }
  } catch (const effects::EffectError& e) {
    fail(kExitConfiguration, "{}: {}", twin_file.string(), e.what());
  } catch (const CommandError&) {
    throw;
  } catch (const record::RecordError&) {
    throw;
  } catch (const std::runtime_error& e) {
    fail(kExitData, "{}", e.what());
  }
  return kExitOk;
}

}  // namespace

void add_explain(Program& program) {
  auto [command, o] = program.command(
      "explain", "Explain an alarm: compare its newest minutes with the loop's twin", run_explain);
  command.required("evidence", o.folder, "folder of the alarm's evidence", existing_folder());
  command.setting("--jobs", o.jobs, "threads; 0: one per core");
  add_background(command, o.background);
  command.flag("--json", o.json, "print the explanation as JSON");
  command.footer(
      "Reads minutes.csv and twin.yaml, writes explanation.json and report.html there.\n"
      "Example: loopwarden explain "
      "/var/lib/loopwardend/evidence/20261121T233348123Z-FIC-101-model_gap");
}

}  // namespace loopwarden::workbench
