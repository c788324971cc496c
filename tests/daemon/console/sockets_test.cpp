// SPDX-License-Identifier: Apache-2.0
// Tests the requests that each socket offers and refuses, and that one socket can't hold up
// another.
#include <atomic>
#include <chrono>
#include <filesystem>
#include <memory>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>

#include <catch2/catch.hpp>
#include <fmt/chrono.h>

#include "base/local_socket.hpp"
#include "tests/daemon/console/console_bench.hpp"

namespace loopwarden::daemon::sockets_test {
namespace {

using base::LocalClient;
using console::Rights;
using console::SocketName;
using console_bench::Bench;
using console_bench::json;
using console_bench::stiction_on;

constexpr std::chrono::seconds kPatience{30};

const Rights kAll{.page = {.alarms = true, .control = true, .reports = true},
                  .edge = {.alarms = true, .control = true}};

const char* const kReading[] = {
    R"({"request": "status"})",
    R"({"request": "describe"})",
    R"({"request": "links"})",
    R"({"request": "setups"})",
    R"({"request": "overview"})",
    R"({"request": "registers"})",
    R"({"request": "registers", "values_only": true})",
    R"({"request": "alarms"})",
    R"({"request": "journal"})",
    R"({"request": "trend", "loop": "FIC-101"})",
    R"({"request": "loop", "loop": "FIC-101"})",
    R"({"request": "windows", "loop": "FIC-101"})",
    R"({"request": "explain", "loop": "FIC-101", "alarm": "stiction"})",
};
const char* const kSet = R"({"request": "set", "loop": "FIC-101", "set_point": 42})";
const char* const kAcknowledgeAll = R"({"request": "acknowledge_all"})";
const char* const kAcknowledge =
    R"({"request": "alarm", "loop": "FIC-101", "alarm": "stiction", "action": "acknowledge"})";
const char* const kReport =
    R"({"request": "report", "loop": "FIC-101", "kind": "gap", "from_ms": 1, "to_ms": 2})";
const char* const kVeto = R"({"request": "veto", "loop": "FIC-101", "veto": true})";
const char* const kRecord = R"({"request": "record", "loop": "FIC-101", "start": "trial"})";
const char* const kOutcome =
    R"({"request": "outcome", "loop": "FIC-101", "found": "nothing", "note": "all in order"})";
const char* const kOrder = R"({"request": "order", "loop": "FIC-101", "order": 1})";

std::string error_of(const json& answer) {
  INFO(answer.dump());
  CHECK(answer.at("ok") == false);
  return answer.value("error", "");
}

// Returns a request of page.sock with additional keys.
std::string with(const char* request, const json& more) {
  json all = json::parse(request);
  all.update(more);
  return all.dump();
}

}  // namespace

TEST_CASE("status.sock reads, and commands no loop", "[console][sockets]") {
  Bench bench(kAll);
  for (const char* request : kReading) {
    INFO(request);
    CHECK(bench.ask_status(request).at("ok") == true);
    CHECK(bench.ask(request).at("ok") == true);
  }
  for (const char* request : {kSet, kAcknowledge, kVeto, kReport, kRecord, kOutcome, kOrder}) {
    INFO(request);
    CHECK_THAT(error_of(bench.ask_status(request)), Catch::Contains("status.sock does not offer"));
  }
  CHECK_THAT(error_of(bench.ask_status(kSet)), Catch::Contains("page.sock and edge.sock"));
  CHECK_THAT(error_of(bench.ask_status(kRecord)), Catch::Contains("control.sock alone"));
  CHECK_THAT(error_of(bench.ask_status(R"({"request": "dance"})")), Catch::Contains("unknown"));
  CHECK(bench.commands().empty());
}

TEST_CASE("page.sock and edge.sock accept only the allowed commands, and don't read",
          "[console][sockets]") {
  const SocketName socket = GENERATE(SocketName::page, SocketName::edge);
  const bool alarms = GENERATE(false, true);
  const bool control = GENERATE(false, true);
  const bool reports = GENERATE(false, true);
  Rights rights;
  (socket == SocketName::page ? rights.page : rights.edge) = {
      .alarms = alarms, .control = control, .reports = reports};
  // The rights of the other socket don't help.
  (socket == SocketName::page ? rights.edge : rights.page) = {
      .alarms = true, .control = true, .reports = true};
  Bench bench(rights);
  bench.run(1);
  bench.board.of(0).window_judged({}, {}, stiction_on());
  for (const char* request : kReading) error_of(bench.ask(request, socket));
  for (const char* request : {kRecord, kOutcome})
    CHECK_THAT(error_of(bench.ask(request, socket)), Catch::Contains("control.sock alone"));

  const std::string name = to_text(socket);
  if (control) {
    CHECK(bench.ask(kSet, socket).at("ok") == true);
    CHECK(bench.commands().size() == 1);
  } else {
    CHECK_THAT(error_of(bench.ask(kSet, socket)), Catch::Contains(name + ": {control: true}"));
    CHECK(bench.commands().empty());
  }
  if (alarms) {
    CHECK(bench.ask(kAcknowledge, socket).at("ok") == true);
    CHECK(bench.ask(kAcknowledgeAll, socket).at("ok") == true);
    CHECK_THAT(error_of(bench.ask(kVeto, socket)), Catch::Contains("no corrective action"));
  } else {
    for (const char* request : {kAcknowledge, kAcknowledgeAll, kVeto}) {
      CHECK_THAT(error_of(bench.ask(request, socket)), Catch::Contains(name + ": {alarms: true}"));
    }
  }
  const std::string about_report = error_of(bench.ask(kReport, socket));
  if (socket == SocketName::edge) {
    CHECK_THAT(about_report, Catch::Contains("control.sock, and on page.sock where allowed"));
  } else if (!reports) {
    CHECK_THAT(about_report, Catch::Contains("page: {reports: true}"));
  } else {
    CHECK(about_report == "nothing is recorded of FIC-101");
  }
  const json order = bench.ask(kOrder, socket);
  CHECK(order.at("ok") == control);
  if (!control && !alarms && !reports) {
    CHECK_THAT(error_of(order), Catch::Contains("not allowed"));
  }
}

TEST_CASE("the journal has the user and address of a command by the page", "[console][sockets]") {
  Bench bench(kAll);
  bench.run(1);
  double set_point = 30.0;  // a different user each time
  const auto peer_of = [&](json names, SocketName socket) {
    names["set_point"] = set_point += 1.0;
    const std::size_t before = bench.ask(R"({"request": "journal"})").at("lines").size();
    CHECK(bench.ask(with(kSet, names), socket).at("ok") == true);
    bench.run(1);
    bench.ask(R"({"request": "order", "loop": "FIC-101", "order": 1})");
    return bench.lines(before + 1).back().at("peer").get<std::string>();
  };
  CHECK(peer_of({{"user", "anna"}, {"address", "10.0.0.5"}}, SocketName::page) ==
        "anna@10.0.0.5 by page (uid 1000)");
  CHECK(peer_of({{"user", "anna"}}, SocketName::page) == "anna by page (uid 1000)");
  CHECK(peer_of({{"address", "fe80::1%eth0"}}, SocketName::edge) ==
        "fe80::1%eth0 by edge (uid 1000)");
  CHECK(peer_of(json::object(), SocketName::edge) == "edge (uid 1000)");
  CHECK(peer_of({{"user", std::string(64, 'x')}}, SocketName::page) ==
        std::string(64, 'x') + " by page (uid 1000)");
}

TEST_CASE("the journal has a technician's finding together with the alarm", "[console][sockets]") {
  Bench bench(kAll);
  bench.run(1);
  bench.board.of(0).window_judged({}, {}, stiction_on());
  const json answer = bench.ask(kOutcome);
  REQUIRE(answer.at("on_disk") == true);
  CHECK_THAT(answer.at("said").get<std::string>(), Catch::StartsWith("stiction "));
  const json line = bench.ask(R"({"request": "journal", "most": 1})").at("lines").at(0);
  CHECK(line.at("what") == "outcome");
  CHECK(line.at("new") == "nothing");
  CHECK(line.at("old") == answer.at("said"));
  CHECK(line.at("reason") == "all in order");
  CHECK(line.at("kind") == "operator");
  CHECK_THAT(error_of(bench.ask(R"({"request": "outcome", "loop": "FIC-101", "found": "rust"})")),
             Catch::Contains("found is stiction, backlash, air, nothing, other"));
  CHECK_THAT(error_of(bench.ask(R"({"request": "outcome", "loop": "FIC-999", "found": "air"})")),
             Catch::Contains("FIC-999"));
}

TEST_CASE("the journal has a note with its author, its time and its words", "[console][sockets]") {
  Bench bench(kAll);
  bench.run(1);
  const std::int64_t about_ms = bench.now_ms - 3'600'000;
  const json note{{"request", "note"},
                  {"loop", "FIC-101"},
                  {"text", "pump changed"},
                  {"about_ms", about_ms},
                  {"user", "anna"}};
  REQUIRE(bench.ask(note.dump(), SocketName::page).at("on_disk") == true);
  const json line = bench.ask(R"({"request": "journal", "most": 1})").at("lines").at(0);
  CHECK(line.at("what") == "note");
  CHECK(line.at("kind") == "operator");
  CHECK(line.at("loop") == "FIC-101");
  CHECK(line.at("reason") == "pump changed");
  CHECK(line.at("peer") == "anna by page (uid 1000)");
  CHECK(line.at("utc_ms") == bench.now_ms);
  CHECK(line.at("new") == fmt::format("{:%FT%TZ}", fmt::gmtime(about_ms / 1000)));
  const auto refused = [&](json change) {
    json wrong = note;
    wrong.update(change);
    return error_of(bench.ask(wrong.dump(), SocketName::page));
  };
  CHECK_THAT(refused({{"text", ""}}), Catch::Contains("what is to be noted"));
  CHECK_THAT(refused({{"text", std::string(201, 'x')}}), Catch::Contains("at most 200 bytes"));
  CHECK_THAT(refused({{"about_ms", bench.now_ms + 1}}), Catch::Contains("a time that has been"));
  CHECK_THAT(refused({{"loop", "FIC-999"}}), Catch::Contains("FIC-999"));
}

TEST_CASE("a request without permission is in the log, but can't fill the log",
          "[console][sockets]") {
  std::ostringstream log;
  const auto usual = spdlog::default_logger();
  spdlog::set_default_logger(std::make_shared<spdlog::logger>(
      "test", std::make_shared<spdlog::sinks::ostream_sink_st>(log)));
  {
    Bench bench;
    for (int i = 0; i < 100; ++i) error_of(bench.ask(kSet, SocketName::page));
  }
  spdlog::set_default_logger(usual);
  const std::string text = log.str();
  INFO(text);
  CHECK_THAT(text, Catch::Contains("refused at page.sock: 'set' is not allowed"));
  CHECK(text.find("'set' is not") == text.rfind("'set' is not"));
}

TEST_CASE("names that could be mistaken for something else are refused", "[console][sockets]") {
  Bench bench(kAll);
  bench.run(1);
  const std::string key = GENERATE("user", "address");
  const json name =
      GENERATE(json(""), json(std::string(65, 'x')), json("an\nna"), json("an\tna"), json("\x7f"),
               json("\x1b[31m"), json("an na"), json("'anna'"), json("\"anna\""), json("`id`"),
               json("anna\\"), json("root@10.0.0.1"), json("ann\xc3\xa4"),
               json(std::string("a\0b", 3)), json(7), json(nullptr), json::array());
  INFO(key << " " << name.dump());
  error_of(bench.ask(with(kSet, {{key, name}}), SocketName::page));
  CHECK(bench.commands().empty());
  CHECK(bench.ask(R"({"request": "journal"})").at("lines").empty());
}

TEST_CASE("on control.sock a request can't name another user", "[console][sockets]") {
  Bench bench(kAll);
  bench.run(1);
  CHECK_THAT(error_of(bench.ask(with(kSet, {{"user", "anna"}}))), Catch::Contains("page.sock"));
  CHECK_THAT(error_of(bench.ask(with(kAcknowledge, {{"address", "10.0.0.5"}}))),
             Catch::Contains("page.sock"));
  CHECK(bench.commands().empty());
}

TEST_CASE("a command is valid only for the values that its sender has seen",
          "[console][sockets][expect]") {
  Bench bench(kAll);
  bench.run(2);
  const auto outcome = [&](const json& request) {
    json all{{"request", "set"}, {"loop", "FIC-101"}};
    all.update(request);
    const json sent = bench.ask(all.dump(), SocketName::page);
    INFO(sent.dump());
    REQUIRE(sent.at("ok") == true);
    bench.run(1);
    return bench.outcome(sent);
  };
  json told = outcome({{"set_point", 60}, {"expect", {{"set_point", 49.9}}}});
  CHECK(told.at("state") == "refused");
  CHECK(told.at("why") == "the set point is now 50, 49.9 was expected");
  CHECK(told.at("now") == json{{"set_point", 50.0}});
  told = outcome({{"set_point", 60}, {"expect", {{"mode", "man"}}}});
  CHECK(told.at("why") == "the mode is now AUTO, MAN was expected");
  CHECK(told.at("now") == json{{"mode", "automatic"}});
  told = outcome({{"set_point", 60}, {"expect", {{"output", 12.5}}}});
  CHECK_THAT(told.at("why").get<std::string>(),
             Catch::StartsWith("the output is ") && Catch::EndsWith(", 12.5 was expected"));
  // A number loses its last digits as text.
  told = outcome({{"set_point", 60}, {"expect", {{"set_point", 50.00009}, {"mode", "auto"}}}});
  CHECK(told.at("state") == "done");
  CHECK(told.at("now").is_null());
  told = outcome({{"set_point", 70}, {"expect", {{"set_point", 60.0002}}}});
  CHECK(told.at("state") == "refused");
  const auto lines = bench.lines(5);
  CHECK(lines[0].at("result") == "refused: the set point is now 50, 49.9 was expected");
  CHECK(lines[3].at("result") == "done");
}

TEST_CASE("an unknown output is shown as no number, and can be expected as such",
          "[console][sockets][expect]") {
  Bench bench(kAll, control::OutputAction::hold());
  bench.run(2);
  CHECK(test::eventually([&] {
    const json loop = bench.ask(R"({"request": "status"})").at("loops").at(0);
    return loop.value("fault", "") == "output unknown" && loop.at("co").is_null() &&
           loop.at("ne107") == "function_check";
  }));
  const auto outcome = [&](double output, const json& expected) {
    const json sent = bench.ask(json{{"request", "set"},
                                     {"loop", "FIC-101"},
                                     {"mode", "man"},
                                     {"output", output},
                                     {"expect", {{"output", expected}}}}
                                    .dump(),
                                SocketName::page);
    INFO(sent.dump());
    REQUIRE(sent.at("ok") == true);
    bench.run(1);
    return bench.outcome(sent);
  };
  json told = outcome(30.0, 0.0);
  CHECK(told.at("why") == "the output is now not known, 0 was expected");
  CHECK(told.at("now") == json{{"output", nullptr}});
  CHECK(outcome(30.0, nullptr).at("state") == "done");
  told = outcome(45.0, nullptr);
  CHECK(told.at("why") == "the output is now 30, not known was expected");
  const auto lines = bench.lines(6);
  CHECK(lines[3].at("what") == "output");
  CHECK(lines[3].at("old") == "");
  CHECK(lines[3].at("new") == "30");
  CHECK(lines[3].at("result") == "done");
}

TEST_CASE("expectations are checked after the commands of others, not when the request arrives",
          "[console][sockets][expect]") {
  Bench bench(kAll);
  bench.run(2);
  const json sent = bench.ask(with(kSet, {{"expect", {{"set_point", 50}}}}), SocketName::page);
  REQUIRE(sent.at("ok") == true);
  // A master's command is taken first in the same cycle.
  bench.loops.front().channels->master_commands.commands.try_push({.set_point = 55.0});
  bench.run(1);
  CHECK(bench.outcome(sent).at("why") == "the set point is now 55, 50 was expected");
  CHECK(bench.loops.front().channels->set_point_wanted == 55.0);
}

TEST_CASE("a request with only brackets is refused, and does not exhaust a thread's stack",
          "[console][sockets]") {
  Bench bench(kAll);
  bench.run(1);
  const std::string open = GENERATE("[", "{\"a\":");
  const std::string close = open == "[" ? "]" : "}";
  std::string deep = R"({"request": "set", "loop": "FIC-101", "set_point": 42, "x": )";
  const std::size_t levels = (base::LocalServer::kLongestLine - 100) / (open.size() + 1);
  for (std::size_t i = 0; i < levels; ++i) deep += open;
  deep += '1';
  for (std::size_t i = 0; i < levels; ++i) deep += close;
  deep += '}';
  CHECK_THAT(error_of(bench.ask(deep, SocketName::page)), Catch::Contains("at most 8 levels"));
  CHECK(bench.commands().empty());
}

TEST_CASE("expectations that can't be parsed are refused", "[console][sockets][expect]") {
  Bench bench(kAll);
  bench.run(1);
  const json expect =
      GENERATE(json(5), json::array(), json{{"set_point", "50"}}, json{{"setpoint", 50}},
               json{{"mode", "cascade"}}, json{{"set_point", nullptr}});
  error_of(bench.ask(with(kSet, {{"expect", expect}}), SocketName::page));
  CHECK(bench.commands().empty());
}

TEST_CASE("page.sock and edge.sock exist only if a right is granted", "[console][sockets]") {
  Bench bench;
  const auto there = [&](const char* name) { return std::filesystem::exists(bench.folder / name); };
  CHECK(there("control.sock"));
  CHECK(there("status.sock"));
  CHECK_FALSE(there("page.sock"));
  CHECK_FALSE(there("edge.sock"));
  bench.run(1);
  bench.server->start();
  // The same as a reload.
  bench.server->set_rights({.page = {.alarms = true, .control = false}, .edge = {}});
  REQUIRE(test::eventually([&] { return there("page.sock"); }));
  CHECK_FALSE(there("edge.sock"));
  LocalClient page((bench.folder / "page.sock").string());
  CHECK(json::parse(page.request(kSet, kPatience)).at("ok") == false);
  bench.server->set_rights({.page = {.alarms = true, .control = true}, .edge = {}});
  CHECK(json::parse(page.request(kSet, kPatience)).at("ok") == true);
  bench.server->set_rights({});
  CHECK(test::eventually([&] { return !there("page.sock"); }));
  CHECK_THROWS(page.request(kSet, kPatience));
  LocalClient operators((bench.folder / "control.sock").string());
  CHECK(json::parse(operators.request(kSet, kPatience)).at("ok") == true);
}

TEST_CASE("a page that floods its socket does not block an operator", "[console][sockets]") {
  Bench bench(kAll);
  bench.run(1);
  bench.server->start();
  bench.readers->start();
  std::atomic<bool> quit{false};
  std::vector<std::thread> flood;
  for (int i = 0; i < 4; ++i) {
    flood.emplace_back([&, i] {
      const char* const socket = i < 2 ? "page.sock" : "status.sock";
      while (!quit) {
        try {
          LocalClient client((bench.folder / socket).string());
          for (int k = 0; k < 50 && !quit; ++k) client.request(kAcknowledge, kPatience);
        } catch (const std::exception&) {  // no room, or disconnected: try again
        }
      }
    });
  }
  LocalClient operators((bench.folder / "control.sock").string());
  for (int i = 0; i < 200; ++i) {
    CHECK(json::parse(operators.request(R"({"request": "alarms"})", kPatience)).at("ok") == true);
  }
  quit = true;
  for (std::thread& thread : flood) thread.join();
}

TEST_CASE("the overview has one entry per loop in each column", "[console][overview]") {
  Bench bench;
  json all = bench.ask_status(R"({"request": "overview"})");
  CHECK(all.at("pv")[0].is_null());
  CHECK(all.at("alarm") == json::array({0}));
  CHECK(all.at("alarm_kind")[0].is_null());
  bench.loops.front().channels->records.try_push({.period_index = 123'456'789,
                                                  .sp = 5.0,
                                                  .pv = 4.123456789,
                                                  .co = 1.0 / 3.0,
                                                  .stem = std::nan(""),
                                                  .mode = control::Mode::automatic,
                                                  .fault = control::Fault::bad_pv,
                                                  .pv_quality = base::Quality::good,
                                                  .flags = 5,
                                                  .requested_mode = control::Mode::automatic,
                                                  .age_ms = 12.5F});
  bench.board.of(0).window_judged({}, {}, stiction_on());
  bench.board.of(0).set_progress(watch::ModeTimes(0.1),
                                 {.control_performance = 91.0, .valve = 40.5},
                                 alarm::WindowState::valid);
  record::RecordRow row;
  REQUIRE(test::eventually([&] { return bench.historian.latest(0, row); }));
  all = bench.ask_status(R"({"request": "overview"})");
  CHECK(all.at("now_ms") == bench.now_ms);
  CHECK(all.at("config_hash") == 17);
  CHECK(all.at("period") == json::array({123'456'789}));
  CHECK(all.at("pv") == json::array({4.12346}));
  CHECK(all.at("co") == json::array({0.333333}));
  CHECK(all.at("stem")[0].is_null());
  CHECK(all.at("mode") == json::array({1}));
  CHECK(all.at("requested_mode") == json::array({1}));
  CHECK(all.at("fault") == json::array({2}));
  CHECK(all.at("quality") == json::array({192}));
  CHECK(all.at("flags") == json::array({5}));
  CHECK(all.at("pv_age_ms") == json::array({12.5}));
  CHECK(all.at("alarm") == json::array({1}));
  CHECK(all.at("alarm_kind") == json::array({0}));
  CHECK(all.at("alarms_unacknowledged") == json::array({1}));
  CHECK(all.at("condition") == json::array({40.5}));
  CHECK(all.at("ne107") == json::array({4}));
}

TEST_CASE("if two alarms wait, the overview names the one of higher priority",
          "[console][overview]") {
  using alarm::AlarmKind;
  Bench bench;
  const auto shown = [&] {
    const json all = bench.ask_status(R"({"request": "overview"})");
    return std::pair(all.at("alarm_kind")[0], all.at("alarms_unacknowledged")[0]);
  };
  bench.board.of(0).window_judged({}, {}, stiction_on());
  bench.board.of(0).process_changed(
      std::vector<daemon::supervision::ProcessNews>{{{AlarmKind::not_normal_mode, true}, ""}});
  CHECK(shown() == std::pair(json(9), json(2)));
  // Which follows from a lost output.
  bench.board.of(0).process_changed(
      std::vector<daemon::supervision::ProcessNews>{{{AlarmKind::output_lost, true}, ""}});
  CHECK(shown() == std::pair(json(7), json(2)));
  bench.board.act(0, {AlarmKind::output_lost, alarm::AlarmAction::acknowledge, 0, "me", {}});
  CHECK(shown() == std::pair(json(0), json(1)));
}

TEST_CASE("reading the registers reports that an alarm changed, though the map doesn't have it",
          "[console][registers]") {
  using alarm::AlarmKind;
  Bench bench;
  const auto changes = [&] {
    return bench.ask_status(R"({"request": "registers", "values_only": true})")
        .at("alarm_changes")
        .get<int>();
  };
  const int before = changes();
  CHECK(changes() == before);
  bench.board.of(0).process_changed(std::vector<daemon::supervision::ProcessNews>{
      {{AlarmKind::bad_pv, true}, "PV is bad: link lost"}});
  const int came = changes();
  CHECK(came > before);
  bench.board.act(0, {AlarmKind::bad_pv, alarm::AlarmAction::acknowledge, 0, "me", {}});
  CHECK(changes() > came);
}

TEST_CASE("the newest windows, with the result of each specialist", "[console][windows]") {
  Bench bench;
  alarm::WindowJudgement judgement;
  judgement.result = alarm::WindowJudgement::Result::fault;
  judgement.fault = alarm::AlarmKind::stiction;
  judgement.probability = {0.75, 0.125, 0.0, 0.0, 0.0, 0.0};
  judgement.severity_percent = 6.25;
  judgement.errors = {4.0, 0.5, 1.0, 2.0, 3.0, 5.0};
  bench.board.of(0).window_judged({}, judgement, {});
  bench.now_ms += 48'000;
  bench.board.of(0).window_not_fit({}, alarm::WindowState::saturated);
  bench.board.of(0).window_not_fit({}, alarm::WindowState::not_enough_movement,
                                   {.result = alarm::WindowJudgement::Result::not_enough_movement});
  const auto windows = [&] {
    return bench.ask_status(R"({"request": "windows", "loop": "FIC-101"})").at("windows");
  };
  const json three = windows();
  REQUIRE(three.size() == 3);
  CHECK(three[0].at("time_ms") == bench.now_ms - 48'000);
  CHECK(three[0].at("verdict") == "stiction");
  CHECK(three[0].at("severity_percent") == 6.25);
  CHECK(three[0].at("suppressed").is_null());
  REQUIRE(three[0].at("specialists").size() == 6);
  CHECK(three[0].at("specialists")[0] ==
        json{{"class", "no_fault"}, {"mse", 4.0}, {"probability", 0.125}});
  CHECK(three[0].at("specialists")[1] ==
        json{{"class", "stiction"}, {"mse", 0.5}, {"probability", 0.75}});
  CHECK(three[1].at("verdict").is_null());
  CHECK(three[1].at("suppressed") == "saturated");
  CHECK(three[1].at("specialists").empty());
  CHECK(three[2].at("verdict") == "not_enough_movement");
  for (int i = 0; i < 100; ++i) {
    ++bench.now_ms;
    bench.board.of(0).window_judged({}, judgement, {});
  }
  const json kept = windows();
  CHECK(kept.size() == 32);
  for (std::size_t i = 0; i < kept.size(); ++i) {
    CHECK(kept[i].at("time_ms") == bench.now_ms - 31 + static_cast<std::int64_t>(i));
  }
}

TEST_CASE("every field of the register map by name, as a master reads it", "[console][registers]") {
  Bench bench;
  bench.loops.front().channels->records.try_push({.period_index = 70'001,
                                                  .sp = 5.0,
                                                  .pv = 4.125,
                                                  .co = 50.0,
                                                  .stem = std::nan(""),
                                                  .pv_quality = base::Quality::good});
  record::RecordRow row;
  REQUIRE(test::eventually([&] { return bench.historian.latest(0, row); }));
  const json all = bench.ask_status(R"({"request": "registers"})");
  const json& names = all.at("names");
  CHECK(names.size() == registers::registers().size());
  REQUIRE(all.at("loops").size() == 1);
  CHECK(all.at("loops")[0].at("tag") == "FIC-101");
  const auto value = [&](const std::string& area, const std::string& table,
                         const std::string& name) {
    std::size_t place = 0;
    for (const json& one : names) {
      if (one.at("area") != area) continue;
      if (one.at("name") == name && one.at("table") == table) {
        return (area == "box" ? all.at("box") : all.at("loops")[0].at("values")).at(place);
      }
      ++place;
    }
    FAIL("no " << name);
    return json();
  };
  CHECK(value("box", "input", "magic") == 0x4C50);
  CHECK(value("box", "input", "utc_milliseconds") == 123);
  CHECK(value("loop", "input", "pv") == 4.125);
  CHECK(value("loop", "input", "sequence_head") == 70'001 % 65'536);
  CHECK(value("loop", "input", "stem").is_null());
  CHECK(value("loop", "input", "stem_scaled").is_null());
  CHECK(value("loop", "input", "condition_valve").is_null());
  CHECK(value("loop", "holding", "sp") == bench.loops.front().channels->set_point_wanted.load());
  const json values = bench.ask_status(R"({"request": "registers", "values_only": true})");
  CHECK_FALSE(values.contains("names"));
  CHECK(values.at("loops") == all.at("loops"));
}

TEST_CASE("the details of a loop have its status, and more", "[console][sockets]") {
  Bench bench;
  json loop = bench.ask_status(R"({"request": "loop", "loop": "FIC-101"})");
  CHECK(loop.at("explanation").is_null());
  CHECK(loop.at("ranges").at("sp_limits") == json({0.0, 100.0}));
  for (const char* more : {"ranges", "explanation", "ok"}) loop.erase(more);
  CHECK(loop == bench.ask_status(R"({"request": "status"})").at("loops")[0]);
  error_of(bench.ask_status(R"({"request": "loop", "loop": "FIC-999"})"));
  const json described = bench.ask_status(R"({"request": "describe"})").at("loops")[0];
  CHECK(described.at("tag") == "FIC-101");
  CHECK(described.at("stem") == false);
  CHECK(described.at("simulated") == false);
  CHECK(described.at("recording") == false);
  CHECK(described.at("specialists").empty());
  CHECK(described.at("folder") == (bench.folder / "segments" / "FIC-101").string());
}

TEST_CASE("while the set point follows the last command, the loop reports its target",
          "[console][sockets][expect]") {
  Bench bench(kAll);
  bench.run(2);
  const auto eventually_told = [&](double set_point) {
    return test::eventually([&] {
      const json loop = bench.ask_status(R"({"request": "loop", "loop": "FIC-101"})");
      return loop.value("sp", json()) == 50.0 &&
             loop.value("set_point_wanted", json()) == set_point;
    });
  };
  CHECK(eventually_told(50.0));
  // The historian's newest row belongs to the last cycle.
  bench.loops.front().channels->set_point_wanted = 62.5;
  CHECK(eventually_told(62.5));
}

TEST_CASE("the journal is searched", "[console][journal]") {
  Bench bench(kAll);
  bench.run(2);
  for (int i = 0; i < 5; ++i) {
    bench.now_ms += 1000;
    bench.ask(with(kSet, {{"user", i % 2 == 0 ? "anna" : "ben"}, {"set_point", 40 + i}}),
              SocketName::page);
    bench.run(1);
    bench.ask(kOrder);
  }
  bench.board.of(0).window_judged({}, {}, stiction_on());
  bench.lines(7);  // of the alarm two: its own, and its incident's
  const auto found = [&](json query) {
    query["request"] = "journal";
    return bench.ask_status(query.dump()).at("lines").size();
  };
  CHECK(found({}) == 7);
  CHECK(found({{"kind", "alarm"}}) == 1);
  CHECK(found({{"kind", "operator"}}) == 5);
  CHECK(found({{"text", "ANNA"}}) == 3);
  CHECK(found({{"text", "anna"}, {"from_ms", bench.now_ms - 1000}}) == 1);
  CHECK(found({{"to_ms", bench.now_ms - 3000}}) == 2);
  CHECK(found({{"before_id", 3}}) == 2);
  CHECK(found({{"most", 2}}) == 2);
  for (const char* bad :
       {R"({"request": "journal", "kind": "other"})", R"({"request": "journal", "text": 5})",
        R"({"request": "journal", "before_id": -1})",
        R"({"request": "journal", "from_ms": "x"})"}) {
    error_of(bench.ask_status(bad));
  }
  error_of(bench.ask_status(json{{"request", "journal"}, {"text", std::string(201, 'x')}}.dump()));
}

}  // namespace loopwarden::daemon::sockets_test
