// SPDX-License-Identifier: Apache-2.0
// The answers of the sockets, byte for byte. tests/daemon/protocol/golden has one line per kind of
// answer. For an intended change, LOOPWARDEN_WRITE_GOLDEN=1 writes the files again.
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <string>
#include <thread>
#include <variant>

#include <catch2/catch.hpp>

#include "daemon/protocol/requests.hpp"
#include "daemon/protocol/setups.hpp"
#include "tests/daemon/console/console_bench.hpp"

namespace loopwarden::daemon::golden_test {
namespace {

using console::SocketName;
using console_bench::Bench;
using console_bench::json;

const console::Rights kAll{
    .page = {.alarms = true, .control = true, .tuning = true, .reports = true, .tests = true},
    .edge = {.alarms = true, .control = true}};

std::string line_of(Bench& bench, const json& request, SocketName socket) {
  const base::LocalServer::Answer answer = bench.server->answer(request.dump(), socket, 1000);
  const auto* const later = std::get_if<base::LocalServer::Later>(&answer);
  std::optional<std::string> told;
  if (later == nullptr) told = std::get<std::string>(answer);
  while (!told && !(told = (*later)())) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  const std::string folder = bench.folder.path().string();
  for (std::size_t at = 0; (at = told->find(folder)) != std::string::npos;) {
    told->replace(at, folder.size(), "/state");
  }
  return *told;
}

Explanation why() {
  return {.alarm = alarm::AlarmKind::stiction,
          .final_name = alarm::AlarmKind::backlash,
          .raised_ms = 1'800'000'001'000,
          .ended_ms = 1'800'000'006'000,
          .verdict = "explained",
          .effect = "backlash",
          .size_percent = 4.5,
          .low_percent = 4.0,
          .high_percent = 5.25,
          .confidence = 0.9375,
          .gap_closed = 0.875,
          .agrees = true,
          .alternatives = {"hysteresis"},
          .sentence = "Play of 4.5 %.",
          .remedy = "Look at the linkage.",
          .next_test = "To decide: move SP.",
          .folder = "/state/evidence/one"};
}

alarm::WindowJudgement stiction_seen() {
  alarm::WindowJudgement judgement;
  judgement.result = alarm::WindowJudgement::Result::fault;
  judgement.fault = alarm::AlarmKind::stiction;
  judgement.probability = {0.75, 0.125, 0.0, 0.0, 0.0, 0.0};
  judgement.severity_percent = 6.25;
  judgement.errors = {4.0, 0.5, 1.0, 2.0, 3.0, 5.0};
  return judgement;
}

// Adds the answers about reports of a recorded loop.
void ask_for_reports(std::map<std::string, std::string>& told) {
  Bench bench(kAll, control::OutputAction::go_to(40.0), true);
  const auto asked = [](std::int64_t from_ms) {
    return json{{"request", "report"},
                {"loop", "FIC-101"},
                {"kind", "gap"},
                {"from_ms", from_ms},
                {"to_ms", from_ms + 60'000}};
  };
  const auto recorded = [&] {
    return bench.historian.status(0).segments.oldest_utc_ms == console_bench::kOldest_ms;
  };
  REQUIRE(test::eventually(recorded));
  const json question{{"request", "reports"}, {"loop", "FIC-101"}};
  told["reports_not_read"] = line_of(bench, question, SocketName::control);
  told["report"] = line_of(bench, asked(console_bench::kOldest_ms), SocketName::control);
  told["report_refused"] =
      line_of(bench, asked(console_bench::kOldest_ms - 1), SocketName::control);
  for (int k = 0; k < 3; ++k) {
    line_of(bench, asked(console_bench::kOldest_ms + k), SocketName::control);
  }
  told["report_no_room"] = line_of(bench, asked(console_bench::kOldest_ms), SocketName::control);
  bench.reports.run_next([](std::chrono::milliseconds) { return false; });
  told["reports"] = line_of(bench, question, SocketName::control);
}

// Returns the answers to all requests, by the name of their golden file.
std::map<std::string, std::string> answers() {
  Bench bench(kAll);
  std::map<std::string, std::string> told;
  const auto ask = [&](const char* name, json request, SocketName socket = SocketName::control) {
    if (!request.contains("loop") && request.value("request", "") != "journal")
      request["loop"] = "FIC-101";
    told[name] = line_of(bench, request, socket);
  };
  const auto written = [&](const char* name, const json& request) {
    CHECK(test::eventually([&] {
      ask(name, request);
      return told[name].find("\"on_disk\":true") != std::string::npos;
    }));
  };
  ask("status_before_the_first_cycle", {{"request", "status"}});
  bench.run(2);
  record::RecordRow row;
  const auto recorded = [&](std::uint64_t period) {
    REQUIRE(test::eventually(
        [&] { return bench.historian.latest(0, row) && row.period_index == period; }));
  };
  recorded(2);

  const json anna{{"user", "anna"}, {"address", "10.0.0.5"}};
  json set{{"request", "set"},
           {"loop", "FIC-101"},
           {"set_point", 42.5},
           {"expect", {{"set_point", 50.0}}}};
  set.update(anna);
  ask("set", set, SocketName::page);
  ask("order_waiting", {{"request", "order"}, {"order", 1}}, SocketName::page);
  bench.run(1);
  written("order_done", {{"request", "order"}, {"order", 1}});
  set["expect"]["set_point"] = 40.0;
  bench.ask(set.dump(), SocketName::page);
  bench.run(1);
  written("order_refused", {{"request", "order"}, {"order", 2}});
  recorded(4);
  ask("set_refused", {{"request", "set"}, {"output", 12.0}});
  json tune{{"request", "tune"}, {"loop", "FIC-101"},
            {"kp", 3.0},         {"ki", 0.25},
            {"kd", 0.0},         {"expect", {{"kp", 2.0}, {"ki", 0.5}, {"kd", 0.0}}}};
  tune.update(anna);
  ask("tune", tune, SocketName::page);
  bench.run(1);
  written("tune_done", {{"request", "order"}, {"order", 3}});
  bench.ask(tune.dump(), SocketName::page);
  bench.run(1);
  written("tune_refused", {{"request", "order"}, {"order", 4}});
  recorded(6);
  ask("twin", {{"request", "twin"}});
  ask("no_such_loop", {{"request", "loop"}, {"loop", "FIC-999"}});
  bench.now_ms += 1000;
  bench.board.of(0).window_judged({.oscillation_index = 1.5,
                                   .period_s = 20.0,
                                   .stick_percent = 6.5,
                                   .stick_source = alarm::StickSource::read_back},
                                  stiction_seen(), console_bench::stiction_on());
  bench.board.of(0).set_progress(watch::ModeTimes(0.1),
                                 {.control_performance = 91.0, .valve = 40.5},
                                 alarm::WindowState::valid);
  bench.board.of(0).controller_not_watched("it is not known");
  bench.board.of(0).set_twin_remarks({.judging = watch::Judging::here,
                                      .load = watch::LoadOutside{.size = 2.5, .since_s = 90.0},
                                      .untested = {{{60.0, true}, {7200.0, false}}}},
                                     1.0);
  bench.board.of(0).explained(why());
  bench.now_ms += 48'000;
  bench.board.of(0).window_not_fit({}, alarm::WindowState::saturated);
  ask("status", {{"request", "status"}});
  ask("loop", {{"request", "loop"}});
  ask("describe", {{"request", "describe"}});
  ask("links", {{"request", "links"}});
  tests::write_file(
      bench.folder / "config/setup/FIC-102.json",
      R"({"answers":{},"steps":{"loop":"done"},"found":{},"begun_ms":1800000000000})");
  ask("setups", {{"request", "setups"}});
  ask("overview", {{"request", "overview"}});
  ask("trend", {{"request", "trend"}});
  ask("windows", {{"request", "windows"}});
  ask("registers", {{"request", "registers"}});
  ask("registers_values_only", {{"request", "registers"}, {"values_only", true}});
  ask("alarms", {{"request", "alarms"}});
  ask("alarm_shelved", {{"request", "alarm"},
                        {"alarm", "backlash"},
                        {"action", "shelve"},
                        {"minutes", 30},
                        {"reason", "packing"}});
  ask("alarm_refused", {{"request", "alarm"}, {"alarm", "hysteresis"}, {"action", "acknowledge"}});
  bench.board.of(0).process_changed(std::vector<daemon::supervision::ProcessNews>{
      {{alarm::AlarmKind::output_lost, true}, "the device is gone"}});
  ask("acknowledge_incident", {{"request", "acknowledge_incident"},
                               {"incident", json::parse(told["loop"]).at("incident").at("id")},
                               {"reason", "seen"}});
  ask("acknowledge_all", {{"request", "acknowledge_all"}, {"reason", "seen"}});
  ask("alarm_design", {{"request", "alarm_design"}});
  ask("alarm_figures", {{"request", "alarm_figures"}, {"hours", 1}});
  ask("veto_refused", {{"request", "veto"}, {"veto", true}, {"reason", "no"}});
  bench.board.of(0).set_corrective_state(alarm::CorrectiveState::waiting);
  ask("veto", {{"request", "veto"}, {"veto", true}, {"reason", "no"}});
  ask("record_started", {{"request", "record"}, {"start", "trial"}});
  ask("record_stopped", {{"request", "record"}, {"stop", true}});
  ask("reload", {{"request", "reload"}, {"dry_run", true}});
  ask("reload_state", {{"request", "reload_state"}, {"reload", 1}});
  ask("explain", {{"request", "explain"}, {"alarm", "stiction"}});
  bench.lines(23);
  ask("journal", {{"request", "journal"}, {"most", 20}});
  ask("outcome", {{"request", "outcome"}, {"found", "stiction"}, {"note", "packing tight"}});
  ask("note", {{"request", "note"}, {"text", "pump changed"}});
  ask("note_refused", {{"request", "note"}, {"text", ""}});
  ask("commissioning_refused", {{"request", "commissioning"}, {"session", 1}});
  ask("outcome_refused", {{"request", "outcome"}, {"found", "rust"}});
  ask_for_reports(told);
  return told;
}

// Returns the answer after its struct has read and written it.
template <class Answer>
json again(const json& answer) {
  return answer.get<Answer>();
}

using Again = json (*)(const json&);
const std::map<std::string, Again> kAgain{
    {"status_before_the_first_cycle", again<protocol::Status>},
    {"status", again<protocol::Status>},
    {"describe", again<protocol::Description>},
    {"links", again<protocol::Links>},
    {"setups", again<protocol::Setups>},
    {"overview", again<protocol::Overview>},
    {"registers", again<protocol::Registers>},
    {"registers_values_only", again<protocol::Registers>},
    {"loop", again<protocol::LoopAnswer>},
    {"trend", again<protocol::Trend>},
    {"windows", again<protocol::Windows>},
    {"alarms", again<protocol::Alarms>},
    {"alarm_design", again<protocol::AlarmDesigns>},
    {"alarm_figures", again<protocol::AlarmFigures>},
    {"explain", again<protocol::Explained>},
    {"journal", again<protocol::Journal>},
    {"set", again<protocol::OrderTaken>},
    {"order_waiting", again<protocol::OrderState>},
    {"order_done", again<protocol::OrderState>},
    {"order_refused", again<protocol::OrderState>},
    {"tune", again<protocol::OrderTaken>},
    {"tune_done", again<protocol::OrderState>},
    {"tune_refused", again<protocol::OrderState>},
    {"twin", again<protocol::TwinModel>},
    {"alarm_shelved", again<protocol::AlarmActed>},
    {"acknowledge_incident", again<protocol::IncidentActed>},
    {"acknowledge_all", again<protocol::AllAcknowledged>},
    {"veto", again<protocol::Vetoed>},
    {"outcome", again<protocol::OutcomeKept>},
    {"note", again<protocol::Noted>},
    {"report", again<protocol::ReportTaken>},
    {"report_no_room", again<protocol::ReportTaken>},
    {"reports", again<protocol::Reports>},
    {"record_started", again<protocol::RecordFile>},
    {"record_stopped", again<protocol::RecordFile>},
    {"reload", again<protocol::ReloadNumber>},
    {"reload_state", again<protocol::ReloadState>}};

}  // namespace

TEST_CASE("the sockets answer as in earlier versions", "[protocol]") {
  const std::filesystem::path folder = LOOPWARDEN_SOURCE_DIR "/tests/daemon/protocol/golden";
  for (const auto& [name, text] : answers()) {
    INFO(name);
    const std::filesystem::path file = folder / (name + ".json");
    if (std::getenv("LOOPWARDEN_WRITE_GOLDEN") != nullptr) std::ofstream(file) << text << '\n';
    std::ifstream stream(file);
    std::string golden;
    std::getline(stream, golden);
    CHECK(text == golden);
  }
}

TEST_CASE("an answer read into its struct is written unchanged", "[protocol]") {
  for (const auto& [name, text] : answers()) {
    INFO(name);
    json answer = json::parse(text);
    if (answer.at("ok") == false) continue;
    json told = kAgain.at(name)(answer);
    told["ok"] = true;
    CHECK(told == answer);
  }
}

TEST_CASE("a field that a daemon of another version does not send has a default", "[protocol]") {
  const json old{{"alarms", {{{"loop", "FIC-101"}, {"alarm", "stiction"}, {"newer", 1}}}}};
  const auto alarms = old.get<protocol::Alarms>();
  REQUIRE(alarms.alarms.size() == 1);
  CHECK(alarms.alarms[0].loop == "FIC-101");
  CHECK_FALSE(alarms.alarms[0].active);
  CHECK(std::isnan(alarms.alarms[0].severity_percent));
  CHECK_THROWS_AS(json::object().get<protocol::Alarms>(), json::exception);
  CHECK_THROWS_AS(json::array().get<protocol::Alarms>(), json::exception);
}

TEST_CASE("a request is unchanged after it was sent", "[protocol]") {
  protocol::SetRequest set;
  set.loop = "FIC-101";
  set.output = 40.0;
  set.expect = protocol::Expected{.set_point = {}, .output = protocol::kNone, .mode = "auto"};
  const json sent = set;
  CHECK(sent == json{{"request", "set"},
                     {"loop", "FIC-101"},
                     {"output", 40.0},
                     {"expect", {{"output", nullptr}, {"mode", "auto"}}}});
  CHECK(json(sent.get<protocol::SetRequest>()) == sent);
}

}  // namespace loopwarden::daemon::golden_test
