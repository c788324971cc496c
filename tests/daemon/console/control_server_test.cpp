// SPDX-License-Identifier: Apache-2.0
#include "daemon/console/control_server.hpp"

#include <sys/resource.h>

#include <algorithm>
#include <catch2/catch.hpp>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <memory>
#include <set>
#include <string>
#include <thread>

#include "base/local_server.hpp"
#include "base/local_socket.hpp"
#include "tests/daemon/console/console_bench.hpp"
#include "tests/support/device/foreign_process.hpp"
#include "tests/support/fake_source.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::daemon::control_server_test {
namespace {

using nlohmann::json;

using console_bench::Bench;
using console_bench::stiction_on;

TEST_CASE("a line that is no request is refused with a reason, and the loop gets no command") {
  Bench bench;
  const std::string line = GENERATE(
      as<std::string>(), "", "not json", "[]", "{}", R"({"request": 5})", R"({"request": "dance"})",
      R"({"request": "set"})", R"({"request": "set", "loop": "FIC-999", "set_point": 5})",
      R"({"request": "set", "loop": "FIC-101"})",
      R"({"request": "set", "loop": "FIC-101", "set_point": "x"})",
      R"({"request": "set", "loop": "FIC-101", "set_point": 100.1})",
      R"({"request": "set", "loop": "FIC-101", "output": -0.1})",
      R"({"request": "set", "loop": "FIC-101", "mode": "cascade"})",
      R"({"request": "set", "loop": "FIC-101", "jacket": "loose"})",
      R"({"request": "trend", "loop": "FIC-101", "from": -1})",
      R"({"request": "record", "loop": "FIC-101", "start": "../../etc/passwd"})",
      R"({"request": "record", "loop": "FIC-101", "start": ".hidden"})",
      R"({"request": "alarm", "loop": "FIC-101"})",
      R"({"request": "alarm", "loop": "FIC-999", "alarm": "stiction", "action": "acknowledge"})",
      R"({"request": "alarm", "loop": "FIC-101", "alarm": "rust", "action": "acknowledge"})",
      R"({"request": "alarm", "loop": "FIC-101", "alarm": "stiction", "action": "forget"})",
      R"({"request": "alarm", "loop": "FIC-101", "alarm": "stiction", "action": "acknowledge"})",
      R"({"request": "alarm", "loop": "FIC-101", "alarm": "stiction", "action": "shelve"})",
      R"({"request": "alarm", "loop": "FIC-101", "alarm": "stiction", )"
      R"("action": "shelve", "minutes": 0})",
      R"({"request": "alarm", "loop": "FIC-101", "alarm": "stiction", )"
      R"("action": "shelve", "minutes": 481})",
      R"({"request": "alarm", "loop": "FIC-101", "alarm": "stiction", )"
      R"("action": "shelve", "minutes": 1e30})",
      R"({"request": "explain", "loop": "FIC-101"})", R"({"request": "journal", "most": "all"})");
  INFO(line);
  const json answer = bench.ask(line);
  CHECK(answer.at("ok") == false);
  CHECK_FALSE(answer.at("error").get<std::string>().empty());
  CHECK(bench.commands().empty());
}

TEST_CASE("the status has the condition indices, null for an unknown index") {
  Bench bench;
  const auto condition = [&] {
    return bench.ask(R"({"request": "status"})").at("loops")[0].at("monitor").at("condition");
  };
  const json unknown = condition();
  CHECK(unknown.size() == 5);
  for (const auto& [name, value] : unknown.items()) CHECK(value.is_null());
  bench.board.of(0).set_progress(watch::ModeTimes(0.1),
                                 {.control_performance = 91.0, .valve = 40.5, .environment = 100.0},
                                 alarm::WindowState::valid);
  CHECK(condition() == json{{"control_performance", 91.0},
                            {"valve", 40.5},
                            {"actuator", nullptr},
                            {"positioner", nullptr},
                            {"environment", 100.0}});
}

TEST_CASE("a stick that no window measured is null in the status, and a measured one is not") {
  Bench bench;
  const auto stick = [&] {
    return bench.ask(R"({"request": "status"})").at("loops")[0].at("monitor").at("stick_percent");
  };
  CHECK(stick().is_null());
  alarm::WindowMeasures measures;
  measures.stick_percent = 4.5;
  measures.stick_source = alarm::StickSource::read_back;
  bench.board.of(0).window_not_fit(measures, alarm::WindowState::no_judge);
  CHECK(stick() == 4.5);
}

TEST_CASE("a command reaches the loop's mailbox unchanged") {
  Bench bench;
  CHECK(bench.ask(R"({"request": "set", "loop": "FIC-101", "set_point": 42.5, "mode": "auto"})")
            .at("ok") == true);
  const auto commands = bench.commands();
  REQUIRE(commands.size() == 1);
  CHECK(commands[0].set_point == 42.5);
  CHECK(commands[0].mode == control::Mode::automatic);
  CHECK_FALSE(commands[0].output);
}

TEST_CASE("gains act from the next cycle on, and are reported as unsaved until a file has them") {
  Bench bench({.page = {.tuning = true}, .edge = {}});
  bench.run(2);
  record::RecordRow row;
  REQUIRE(test::eventually([&] { return bench.historian.latest(0, row); }));
  const auto gains = [&] {
    const json loop = bench.ask(R"({"request": "loop", "loop": "FIC-101"})");
    CHECK(bench.ask(R"({"request": "overview"})").at("not_in_file")[0] ==
          (loop.at("gains").at("not_in_file") == true ? 1 : 0));
    return loop.at("gains");
  };
  const json of_file{{"kp", 2.0}, {"ki", 0.5}, {"kd", 0.0}};
  CHECK(gains().at("in_force") == of_file);
  CHECK(gains().at("not_in_file") == false);
  json tune{{"request", "tune"}, {"loop", "FIC-101"}, {"kp", 3.0},      {"ki", 0.25},
            {"kd", 0.0},         {"expect", of_file}, {"user", "ella"}, {"address", "10.0.0.5"}};
  const json sent = bench.ask(tune.dump(), console::SocketName::page);
  REQUIRE(sent.at("ok") == true);
  bench.run(1);
  CHECK(bench.outcome(sent).at("state") == "done");
  const json now = gains();
  CHECK(now.at("in_force") == json{{"kp", 3.0}, {"ki", 0.25}, {"kd", 0.0}});
  CHECK(now.at("file") == of_file);
  CHECK(now.at("not_in_file") == true);
  CHECK(now.at("by") == "ella@10.0.0.5 by page (uid 1000)");
  CHECK(now.at("since_ms") == bench.now_ms);

  // The values that the user saw are out of date.
  const json late = bench.ask(tune.dump(), console::SocketName::page);
  bench.run(1);
  const json refused = bench.outcome(late);
  CHECK(refused.at("state") == "refused");
  CHECK(refused.at("now") == json{{"gains", {{"kp", 3.0}, {"ki", 0.25}, {"kd", 0.0}}}});
  CHECK_THAT(refused.at("why").get<std::string>(),
             Catch::Contains("now kp 3 ki 0.25 kd 0") && Catch::Contains("kp 2 ki 0.5 kd 0"));

  // Back to the gains of the file.
  tune["expect"] = now.at("in_force");
  tune["kp"] = 2.0;
  tune["ki"] = 0.5;
  REQUIRE(bench.ask(tune.dump(), console::SocketName::page).at("ok") == true);
  bench.run(1);
  CHECK(test::eventually([&] {
    bench.ask(R"({"request": "order", "loop": "FIC-101", "order": 3})");
    return gains().at("not_in_file") == false;
  }));
  const auto lines = bench.lines(3);
  CHECK(lines[0].at("what") == "gains");
  CHECK(lines[0].at("old") == "kp 2 ki 0.5 kd 0");
  CHECK(lines[0].at("new") == "kp 3 ki 0.25 kd 0");
  CHECK(lines[0].at("result") == "done");
  CHECK(lines[0].at("reason") == "not in file: a restart takes kp 2 ki 0.5 kd 0");
  CHECK_THAT(lines[1].at("result").get<std::string>(), Catch::Contains("refused"));
  CHECK(lines[2].at("reason") == "");
}

TEST_CASE("gains that no file could have, or that are not allowed, are refused") {
  Bench bench({.page = {.control = true}, .edge = {}});
  bench.run(2);
  json tune{{"request", "tune"}, {"loop", "FIC-101"}, {"kp", 3.0}, {"ki", 0.25}, {"kd", 0.0}};
  auto socket = console::SocketName::control;
  std::string why;
  SECTION("below 0") {
    tune["kd"] = -0.1;
    why = "a gain must be a number of at least 0";
  }
  SECTION("no gain moves the output") {
    tune["kp"] = tune["ki"] = 0.0;
    why = "kp and ki are both 0";
  }
  SECTION("one is missing") {
    tune.erase("ki");
    why = "ki must be a number";
  }
  SECTION("half an expectation") {
    tune["expect"] = {{"kp", 2.0}};
    why = "expect is an object of kp, ki and kd";
  }
  SECTION("the page has another right") {
    socket = console::SocketName::page;
    why = "needs page: {tuning: true}";
  }
  SECTION("the edge never has the right") {
    bench.server->set_rights({.page = {}, .edge = {.tuning = true}});
    socket = console::SocketName::edge;
    why = "on control.sock, and on page.sock where allowed";
  }
  SECTION("another controller has the loop") {
    bench.loops[0].source = std::make_unique<tests::FakeSource>();
    why = "controlled elsewhere";
  }
  const json answer = bench.ask(tune.dump(), socket);
  CHECK(answer.at("ok") == false);
  CHECK_THAT(answer.at("error").get<std::string>(), Catch::Contains(why));
  CHECK(bench.commands().empty());
}

TEST_CASE("only page.sock has the right to test, and only if it is granted") {
  Bench bench({.page = {.tuning = true}, .edge = {.control = true}});
  bench.run(2);
  for (const char* request : {"commissioning", "test_result", "reload", "reload_state"}) {
    const auto error = [&](console::SocketName socket) {
      return bench.ask(json{{"request", request}, {"loop", "FIC-101"}}.dump(), socket)
          .value("error", "");
    };
    CHECK_THAT(error(console::SocketName::page), Catch::Contains("needs page: {tests: true}"));
    CHECK_THAT(error(console::SocketName::edge), Catch::Contains("page.sock where allowed"));
  }
  bench.server->set_rights({.page = {.tests = true}, .edge = {}});
  const json result{{"request", "test_result"}, {"loop", "FIC-101"}, {"explanations", "a or b"},
                    {"decided", "a"},           {"user", "ella"},    {"predicted", 0.9},
                    {"probability", 0.97}};
  CHECK(bench.ask(result.dump(), console::SocketName::page).at("ok") == true);
  CHECK(bench.lines(1)[0].at("peer") == "ella by page (uid 1000)");
}

TEST_CASE("manual and an output in one command: both, in one cycle, and both are in the journal") {
  Bench bench;
  bench.run(2);
  record::RecordRow row;
  REQUIRE(test::eventually([&] { return bench.historian.latest(0, row); }));
  const json sent =
      bench.ask(R"({"request": "set", "loop": "FIC-101", "output": 42, "mode": "man"})");
  REQUIRE(sent.at("ok") == true);
  CHECK(bench.outcome(sent).at("state") == "waiting");
  bench.run(1);
  CHECK(static_cast<tests::FakeLoopIo&>(*bench.loops.front().io).written == Approx(42.0));
  CHECK(bench.outcome(sent).at("state") == "done");
  const auto lines = bench.lines(2);
  CHECK(lines[0].at("kind") == "operator");
  CHECK(lines[0].at("peer") == "uid 1000");
  CHECK(lines[0].at("loop") == "FIC-101");
  CHECK(lines[0].at("what") == "mode");
  CHECK(lines[0].at("old") == "AUTO");
  CHECK(lines[0].at("new") == "MAN");
  CHECK(lines[0].at("result") == "done");
  CHECK(lines[1].at("what") == "output");
  CHECK(lines[1].at("new") == "42");
  CHECK(lines[1].at("result") == "done");
  CHECK(test::eventually([&] { return bench.outcome(sent).at("on_disk") == true; }));
}

TEST_CASE(
    "a command that can't act is refused with the reason, and the journal has it as refused") {
  Bench bench;
  bench.run(2);
  const auto refused = [&](const char* request, const char* reason) {
    const json answer = bench.ask(request);
    INFO(request << "\n" << answer.dump());
    CHECK(answer.at("ok") == false);
    CHECK_THAT(answer.at("error").get<std::string>(), Catch::Contains(reason));
    CHECK(bench.commands().empty());
  };
  refused(R"({"request": "set", "loop": "FIC-101", "output": 60})",
          "in automatic the controller has the output");
  refused(R"({"request": "set", "loop": "FIC-101", "output": 61, "mode": "auto"})",
          "in automatic the controller has the output");
  refused(R"({"request": "set", "loop": "FIC-101", "set_point": 20, "mode": "man"})",
          "in manual the set point follows PV");
  refused(R"({"request": "set", "loop": "FIC-101", "set_point": 100.5})",
          "set point must be within 0 to 100 (got 100.5)");
  refused(R"({"request": "record", "loop": "FIC-101", "start": ".hidden"})", "a record's name");
  const auto lines = bench.lines(7);
  for (const json& line : lines) {
    CHECK(line.at("kind") == "operator");
    CHECK(line.at("peer") == "uid 1000");
    CHECK_THAT(line.at("result").get<std::string>(), Catch::StartsWith("refused: "));
  }
  CHECK(lines[0].at("what") == "output");
  CHECK(lines[6].at("what") == "record started");
}

TEST_CASE("the next command is judged by the mode of the previous one, taken or not") {
  Bench bench;
  bench.run(2);
  CHECK(bench.ask(R"({"request": "set", "loop": "FIC-101", "mode": "man"})").at("ok") == true);
  CHECK(bench.ask(R"({"request": "set", "loop": "FIC-101", "output": 45})").at("ok") == true);
  CHECK(bench.ask(R"({"request": "set", "loop": "FIC-101", "set_point": 45})").at("ok") == false);
  bench.run(1);
  CHECK(static_cast<tests::FakeLoopIo&>(*bench.loops.front().io).written == Approx(45.0));
  CHECK(bench.ask(R"({"request": "set", "loop": "FIC-101", "output": 46})").at("ok") == true);
}

TEST_CASE("a command that was accepted but can't act when the loop takes it is reported") {
  Bench bench;
  bench.run(2);
  CHECK(bench.ask(R"({"request": "set", "loop": "FIC-101", "mode": "man"})").at("ok") == true);
  bench.run(1);
  const json sent = bench.ask(R"({"request": "set", "loop": "FIC-101", "output": 45})");
  CHECK(sent.at("ok") == true);
  // A master's command is faster.
  bench.loops.front().channels->master_commands.commands.try_push(
      {.mode = control::Mode::automatic});
  bench.run(1);
  const json outcome = bench.outcome(sent);
  CHECK(outcome.at("state") == "refused");
  CHECK_THAT(outcome.at("why").get<std::string>(), Catch::Contains("in automatic"));
  CHECK_THAT(bench.lines(2)[1].at("result").get<std::string>(), Catch::StartsWith("refused: "));
  CHECK(bench.ask(R"({"request": "status"})").at("loops")[0].at("orders_refused") == 1);
}

TEST_CASE("a command that no cycle takes is in the journal when the daemon ends") {
  Bench bench;
  bench.run(2);
  CHECK(bench.ask(R"({"request": "set", "loop": "FIC-101", "set_point": 45})").at("ok") == true);
  bench.server->stop();
  std::vector<journal::JournalRow> lines;
  REQUIRE(test::eventually([&] {
    lines = bench.journal.newest(10);
    return !lines.empty();
  }));
  CHECK(lines.size() == 1);
  CHECK_THAT(lines.front().entry.result, Catch::StartsWith("not taken"));
}

TEST_CASE("a record that is started and stopped is in the journal with its file") {
  Bench bench;
  const json file =
      bench.ask(R"({"request": "record", "loop": "FIC-101", "start": "trial"})").at("file");
  bench.ask(R"({"request": "record", "loop": "FIC-101", "stop": true})");
  const auto lines = bench.lines(2);
  CHECK(lines[0].at("what") == "record started");
  CHECK(lines[0].at("new") == file);
  CHECK(lines[0].at("peer") == "uid 1000");
  CHECK(lines[1].at("what") == "record stopped");
}

TEST_CASE("the status has jacket and compensator in two places, with a unit each") {
  Bench bench;
  bench.loops.front().channels->records.try_push({.period_index = 1,
                                                  .jacket_rate = 0.5F,
                                                  .compensator = 2.0F,
                                                  .flags = record::kCompensatorActs});
  record::RecordRow row;
  REQUIRE(test::eventually([&] { return bench.historian.latest(0, row); }));
  const json loop = bench.ask(R"({"request": "status"})").at("loops")[0];
  CHECK(loop.at("jacket").at("rate") == 0.5);
  CHECK(loop.at("jacket").at("acting") == false);
  CHECK(loop.at("compensator").at("added") == 2.0);
  CHECK(loop.at("compensator").at("acting") == true);
  const json trend = bench.ask(R"({"request": "trend", "loop": "FIC-101"})");
  CHECK(trend.at("jacket")[0] == 0.5);
  CHECK(trend.at("compensator")[0] == 2.0);
}

TEST_CASE("the paper form of the jacket can't be switched on") {
  Bench bench;
  CHECK(bench.ask(R"({"request": "set", "loop": "FIC-101", "jacket": "on"})").at("ok") == false);
  CHECK(bench.ask(R"({"request": "set", "loop": "FIC-101", "jacket": "shadow"})").at("ok") == true);
}

TEST_CASE(
    "the trend has the recorded rows of the loop, missing values as null, from the requested "
    "period on") {
  Bench bench;
  for (std::uint64_t k = 10; k < 20; ++k)
    bench.record(k, k == 15 ? std::nan("") : static_cast<double>(k));
  record::RecordRow row;
  REQUIRE(
      test::eventually([&] { return bench.historian.latest(0, row) && row.period_index == 19; }));
  const json trend = bench.ask(R"({"request": "trend", "loop": "FIC-101", "from": 14})");
  CHECK(trend.at("period") == json({14, 15, 16, 17, 18, 19}));
  CHECK(trend.at("pv")[0] == 14.0);
  CHECK(trend.at("pv")[1].is_null());
  const json status = bench.ask(R"({"request": "status"})");
  CHECK(status.at("loops")[0].at("pv") == 19.0);
  CHECK(status.at("loops")[0].at("recording").at("rows") == 10);
}

TEST_CASE("the status shows a PV at the end of its transmitter's range") {
  Bench bench;
  const auto limit = [&](std::uint64_t period, hal::Limit at) {
    bench.loops.front().channels->records.try_push(
        {.period_index = period,
         .sp = 5.0,
         .pv = 5.0,
         .flags = record::kAtHigh,  // CO's end is not PV's
         .pv_limit = at});
    record::RecordRow row;
    REQUIRE(test::eventually(
        [&] { return bench.historian.latest(0, row) && row.period_index == period; }));
    return bench.ask(R"({"request": "status"})").at("loops")[0].at("pv_limit").get<std::string>();
  };
  CHECK(limit(1, hal::Limit::none) == "none");
  CHECK(limit(2, hal::Limit::low) == "low");
  CHECK(limit(3, hal::Limit::high) == "high");
}

TEST_CASE("a CSV record is written on demand, and gaps in it are empty rows") {
  Bench bench;
  const std::string file =
      bench.ask(R"({"request": "record", "loop": "FIC-101", "start": "trial"})").at("file");
  CHECK(bench.ask(R"({"request": "record", "loop": "FIC-101", "start": "second"})").at("ok") ==
        false);
  for (const std::uint64_t k : {100U, 101U, 104U, 105U}) bench.record(k, 1.0);
  record::RecordRow row;
  REQUIRE(
      test::eventually([&] { return bench.historian.latest(0, row) && row.period_index == 105; }));
  // The rows are visible before the recorder has them. It has them when the next round begins.
  const std::uint64_t round = bench.historian.ticks();
  REQUIRE(test::eventually([&] { return bench.historian.ticks() > round; }));
  CHECK(bench.ask(R"({"request": "record", "loop": "FIC-101", "stop": true})").at("file") == file);
  const record::Record record = record::read_record(file);
  CHECK(record.size() == 6);
  CHECK(numeric::missing(record.pv) == 2);
  CHECK(record.time_s.front() == 0.0);
  CHECK(record.period_s == Approx(0.1));
}

TEST_CASE("all alarms are acknowledged by one request, with one line for each and one answer") {
  Bench bench;
  bench.board.of(0).window_judged({}, {}, stiction_on());
  constexpr const char* kAll = R"({"request": "acknowledge_all", "reason": "seen"})";
  json done = bench.ask(kAll);
  CHECK(done.at("ok") == true);
  CHECK(done.at("on_disk") == true);
  CHECK(done.at("acknowledged") == json::parse(R"([{"loop": "FIC-101", "alarm": "stiction"}])"));
  done = bench.ask(kAll);
  CHECK(done.at("acknowledged").empty());
  CHECK(done.at("on_disk") == true);
  int lines = 0;
  const json journal = bench.ask(R"({"request": "journal", "most": 50})");
  for (const json& line : journal.at("lines")) {
    lines += line.at("what") == "acknowledge" && line.at("reason") == "seen" ? 1 : 0;
  }
  CHECK(lines == 1);
}

TEST_CASE(
    "a person who acts on an alarm waits for the disk, but the thread of the sockets does not") {
  Bench bench;
  bench.board.of(0).window_judged({}, {}, stiction_on());
  for (const char* request :
       {R"({"request": "alarm", "loop": "FIC-101", "alarm": "stiction", "action": "acknowledge"})",
        R"({"request": "acknowledge_all"})"}) {
    const auto answer = bench.server->answer(request, console::SocketName::control, 1000);
    CHECK(std::holds_alternative<base::LocalServer::Later>(answer));
  }
}

TEST_CASE("an offered corrective action begins at the stiction alarm, and only there") {
  Bench bench;
  const auto calm = [&](const char* alarm) {
    return bench.ask(json{
        {"request", "alarm"},
        {"loop", "FIC-101"},
        {"alarm", alarm},
        {"action", "calm"},
        {"reason",
         "until July"}}.dump());
  };
  CHECK(calm("stiction").value("error", "").find("offers nothing") != std::string::npos);
  bench.board.of(0).set_corrective_state(alarm::CorrectiveState::offered);
  CHECK(calm("backlash").at("ok") == false);
  CHECK_FALSE(bench.board.of(0).take_begin_request());
  CHECK(calm("stiction").at("ok") == true);
  CHECK(bench.board.of(0).take_begin_request());
  CHECK_FALSE(bench.board.of(0).take_begin_request());
}

TEST_CASE("an alarm is listed, acknowledged, shelved and explained, and the journal has it all") {
  Bench bench;
  bench.board.of(0).window_judged({}, {}, stiction_on());
  const auto stiction = [&] {
    return bench.ask(R"({"request": "status"})").at("loops")[0].at("alarms").at("stiction");
  };
  CHECK(stiction().at("state") == "unacknowledged");
  CHECK(stiction().at("severity_percent") == 6.5);
  CHECK(bench.ask(R"({"request": "alarms"})").at("alarms").size() == 18);
  // For `unknown`, neither the cause nor its size is known.
  const json answer = bench.ask(R"({"request": "alarms"})");
  for (const json& alarm : answer.at("alarms")) {
    const json& name = alarm.at("alarm");
    const bool sizeless = name != "stiction" && name != "backlash" && name != "hysteresis" &&
                          name != "low_air_supply";
    CHECK(alarm.at("severity_percent").is_null() == sizeless);
    CHECK(alarm.at("worst_severity_percent").is_null() == sizeless);
  }

  json done = bench.ask(
      R"({"request": "alarm", "loop": "FIC-101", "alarm": "stiction", "action": "acknowledge"})");
  CHECK(done.at("ok") == true);
  CHECK(done.at("on_disk") == true);
  CHECK(stiction().at("state") == "acknowledged");

  done = bench.ask(R"({"request": "alarm", "loop": "FIC-101", "alarm": "stiction", )"
                   R"("action": "shelve", "minutes": 30, "reason": "packing ordered"})");
  CHECK(done.at("alarm").at("state") == "shelved");
  CHECK(done.at("alarm").at("shelved_until_ms") == bench.now_ms + 30 * 60'000);

  const json told = bench.ask(R"({"request": "explain", "loop": "FIC-101", "alarm": "stiction"})");
  CHECK_FALSE(told.at("action").get<std::string>().empty());
  REQUIRE(told.at("history").size() >= 3);
  CHECK(told.at("history").back().at("to") == "unacknowledged");

  const json lines = bench.ask(R"({"request": "journal", "most": 50})").at("lines");
  bool reason = false;
  for (const json& line : lines) {
    reason = reason || (line.at("what") == "shelve" && line.at("reason") == "packing ordered" &&
                        line.at("peer") == "uid 1000" && line.at("new") == "30 min");
  }
  CHECK(reason);
}

TEST_CASE("the settings of the alarms are shown for all loops or for one") {
  Bench bench;
  const auto loops_of = [&](const json& request) {
    std::set<std::string> loops;
    const json answer = bench.ask(request.dump());
    for (const json& one : answer.at("alarms")) loops.insert(one.at("loop"));
    return loops;
  };
  const json all{{"request", "alarm_design"}};
  json one = all;
  one["loop"] = "FIC-101";
  CHECK(loops_of(all).count("FIC-101") == 1);
  CHECK(loops_of(one) == std::set<std::string>{"FIC-101"});
  one["loop"] = "FIC-999";
  CHECK(bench.ask(one.dump()).at("error") == "no loop 'FIC-999'");
  one["loop"] = 7;
  CHECK(bench.ask(one.dump()).at("ok") == false);
}

TEST_CASE("a host alarm is listed, explained, acknowledged and journalled like others") {
  using alarm::BoxAlarm;
  Bench bench;
  daemon::host::BoxReport full;
  full.found[index_of(BoxAlarm::disk_full)] = true;
  full.why[index_of(BoxAlarm::disk_full)] = "99 MB are left";
  bench.box_alarms.look(full, 0);
  const json told = bench.ask(R"({"request": "explain", "loop": "box", "alarm": "disk_full"})");
  CHECK(told.at("alarm").at("state") == "unacknowledged");
  CHECK(told.at("alarm").at("priority") == "high");
  CHECK_THAT(told.at("action").get<std::string>(), Catch::Contains("Free space on the disk"));
  const auto order = [&](const char* alarm, const char* action) {
    return bench.ask(
        json{{"request", "alarm"}, {"loop", "box"}, {"alarm", alarm}, {"action", action}}.dump());
  };
  CHECK(order("disk_full", "acknowledge").at("alarm").at("state") == "acknowledged");
  CHECK(order("disk_full", "acknowledge").at("ok") == false);
  CHECK_THAT(order("bad_pv", "acknowledge").at("error").get<std::string>(),
             Catch::Contains("the box has no alarm 'bad_pv'; its alarms are disk_full"));
  const json lines = bench.ask(R"({"request": "journal", "loop": "box"})").at("lines");
  REQUIRE(lines.size() >= 2);
  CHECK(lines.back().at("reason") == "99 MB are left");
  const json alarms = bench.ask(R"({"request": "alarms"})").at("alarms");
  CHECK(std::any_of(alarms.begin(), alarms.end(), [](const json& one) {
    return one.at("loop") == "box" && one.at("alarm") == "disk_full";
  }));
}

TEST_CASE("a host alarm is acknowledged with all, counts as a change, and may be stale") {
  using alarm::BoxAlarm;
  Bench bench;
  const auto changes = [&] {
    return bench.ask(R"({"request": "registers"})").at("alarm_changes").get<int>();
  };
  const int before = changes();
  daemon::host::BoxReport full;
  full.found[index_of(BoxAlarm::disk_full)] = true;
  bench.box_alarms.look(full, 0);
  CHECK(changes() == before + 1);
  const json all = bench.ask(R"({"request": "acknowledge_all"})").at("acknowledged");
  REQUIRE(all.size() == 1);
  CHECK(all.at(0).at("loop") == "box");
  CHECK(all.at(0).at("alarm") == "disk_full");
  CHECK(changes() == before + 2);
  CHECK(bench.ask(R"({"request": "acknowledge_all"})").at("acknowledged").empty());
  const auto stale = [&] {
    return bench.ask(R"({"request": "alarm_figures", "hours": 1})").at("stale");
  };
  CHECK(stale().empty());
  bench.now_ms += 24LL * 3'600'000 + 1;
  REQUIRE(stale().size() == 1);
  CHECK(stale().at(0).at("loop") == "box");
  CHECK(stale().at(0).at("alarm") == "disk_full");
}

TEST_CASE(
    "the changes of a host alarm below its shelf are remembered; its commands are those of a "
    "loop") {
  using alarm::AlarmAction;
  using alarm::BoxAlarm;
  Bench bench;
  daemon::host::BoxReport full;
  auto& found = full.found[index_of(BoxAlarm::disk_full)];
  const auto shelve = [&](std::int64_t ms) {
    return bench.box_alarms.act({BoxAlarm::disk_full, AlarmAction::shelve, ms, "me", {}});
  };
  CHECK(shelve(9LL * 3'600'000).why ==
        "an alarm is shelved for at least a minute, and for 480 min at most");
  REQUIRE(shelve(3'600'000).accepted);
  found = true;
  bench.box_alarms.look(full, 0);
  const auto newest = [&] {
    const json lines =
        bench.ask(R"({"request": "journal", "loop": "box", "kind": "alarm"})").at("lines");
    return lines.empty() ? json{{"from", ""}} : lines.at(0);
  };
  REQUIRE(test::eventually([&] { return newest().at("from") == "shelved"; }));
  CHECK(newest().at("to") == "shelved");
  CHECK(bench.journal.status().lost == 0);
  // Like after a restart.
  daemon::journal::Journal again({.folder = bench.folder.path()});
  const auto states = again.open();
  CHECK(states.memories.at({"box", "disk_full"}).raised == alarm::AlarmState::unacknowledged);
}

TEST_CASE(
    "a process alarm is listed, explained by its guide, acknowledged and journalled like others") {
  Bench bench;
  bench.board.of(0).process_changed(std::vector<daemon::supervision::ProcessNews>{
      {{alarm::AlarmKind::bad_pv, true}, "PV is bad: link lost"}});
  const json told = bench.ask(R"({"request": "explain", "loop": "FIC-101", "alarm": "bad_pv"})");
  CHECK(told.at("alarm").at("state") == "unacknowledged");
  CHECK_THAT(told.at("cause").get<std::string>(), Catch::Contains("PV can't be used"));
  CHECK(told.at("evidence").is_null());
  CHECK(told.at("explanation").is_null());
  const json done = bench.ask(
      R"({"request": "alarm", "loop": "FIC-101", "alarm": "bad_pv", "action": "acknowledge"})");
  CHECK(done.at("alarm").at("state") == "acknowledged");
  bench.board.of(0).process_changed(std::vector<daemon::supervision::ProcessNews>{
      {{alarm::AlarmKind::bad_pv, false}, "PV is good"}});
  const std::vector<json> lines = bench.lines(4);
  CHECK(lines[0].at("to") == "unacknowledged");
  CHECK(lines[0].at("reason") == "PV is bad: link lost");
  CHECK(lines[0].at("severity_percent").is_null());
  CHECK(lines[1].at("what") == "acknowledge");
  CHECK(lines[3].at("to") == "normal");
  CHECK(lines[3].at("reason") == "PV is good");
  CHECK_THAT(bench.ask(R"({"request": "explain", "loop": "FIC-101", "alarm": "bad"})")
                 .at("error")
                 .get<std::string>(),
             Catch::Contains("model_gap, bad_pv, output_lost, output_unknown, not_normal_mode"));
}

TEST_CASE(
    "over the socket: requests are answered line by line, and garbage does not end the server") {
  Bench bench;
  bench.server->start();
  base::LocalClient client((bench.folder / "control.sock").string());
  const auto patience = std::chrono::milliseconds(5000);
  CHECK(json::parse(client.request("garbage", patience)).at("ok") == false);
  CHECK(json::parse(client.request(R"({"request": "status"})", patience)).at("ok") == true);
  {
    base::LocalClient other((bench.folder / "control.sock").string());
    CHECK(json::parse(other.request(R"({"request": "status"})", patience)).at("ok") == true);
  }
  CHECK(json::parse(client.request(R"({"request": "status"})", patience)).at("ok") == true);
  CHECK_THROWS_WITH(ControlServer(bench.folder.path(), bench.plant(), bench.archive(), bench.daemon,
                                  bench.daemon, console::Rights{}),
                    Catch::Contains("another daemon"));
}

TEST_CASE("commands beyond the room of the mailbox are refused, and accepted again after a cycle") {
  Bench bench;
  const auto set = [&] {
    return bench.ask(R"({"request": "set", "loop": "FIC-101", "set_point": 5, "mode": "auto"})");
  };
  for (std::size_t i = 0; i < rt::CommandMailbox::kRoom; ++i) CHECK(set().at("ok") == true);
  CHECK_THAT(set().at("error").get<std::string>(), Catch::Contains("too many commands"));
  bench.run(1);
  CHECK(set().at("ok") == true);
}

TEST_CASE("without descriptors the control socket pauses, and later serves the waiting clients") {
  tests::TemporaryFolder folder;
  const std::string path = (folder / "socket").string();
  base::LocalServer server;
  server.listen({.path = path}, [](std::string_view, unsigned) { return std::string("{}"); });
  base::LocalClient client(path);
  std::atomic<bool> asking{false};
  std::atomic<bool> has_answer{false};
  std::thread asks([&] {
    asking = true;
    client.request("x", std::chrono::minutes(2));
    has_answer = true;
  });
  const auto answered = [&] {
    for (int i = 0; i < 5; ++i) server.serve(std::chrono::milliseconds(1));
    return has_answer.load();
  };
  // A sanitizer's check of the thread's start also needs a descriptor.
  REQUIRE(test::eventually([&] { return asking.load(); }));
  rlimit before{};
  getrlimit(RLIMIT_NOFILE, &before);
  const rlimit none{3, before.rlim_max};
  setrlimit(RLIMIT_NOFILE, &none);
  const bool refused = !answered();
  setrlimit(RLIMIT_NOFILE, &before);
  CHECK(refused);
  CHECK_FALSE(answered());  // the next attempt is made later
  CHECK(test::eventually([&] { return answered(); }));
  asks.join();
}

}  // namespace
}  // namespace loopwarden::daemon::control_server_test
