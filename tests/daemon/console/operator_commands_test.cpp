// SPDX-License-Identifier: Apache-2.0
// Commands to a loop in commissioning, and the daemon's action when the session's holder is gone.

#include <catch2/catch.hpp>

#include <chrono>
#include <cstdint>
#include <optional>
#include <variant>
#include <vector>

#include "daemon/console/operator_commands.hpp"
#include "base/clock.hpp"
#include "daemon/app/gateway_loops.hpp"
#include "daemon/console/plant_readings.hpp"
#include "daemon/console/request.hpp"
#include "tests/daemon/console/console_bench.hpp"

namespace loopwarden::daemon::operator_commands_test {
namespace {

using console_bench::json;

// Only the operators' side, so that a test controls the time.
struct Bench : console_bench::Console {
  using Console::Console;

  json order(json request) {
    if (!request.contains("loop")) request["loop"] = "FIC-101";
    const auto answer = console::answer_line(request.dump(), [&](const json& asked) {
      return std::get<std::string>(
          operators.answer(protocol::name_of(asked), asked, {.peer = "uid 0"}));
    });
    return json::parse(answer);
  }
  json commission(json more = json::object()) {
    more["request"] = "commissioning";
    return order(more);
  }
  json commissioning() {
    return ask_status(R"({"request": "loop", "loop": "FIC-101"})").at("commissioning");
  }
  tests::FakeLoopIo& io() { return dynamic_cast<tests::FakeLoopIo&>(*loops[0].io); }
  void stop_action(control::OutputAction action) {
    rt::LoopSettings settings = loops[0].settings->get();
    settings.safety.on_stop = action;
    loops[0].channels->in_force.publish(settings);
  }

  console::OperatorCommands operators{plant(), archive(), daemon, daemon};
};

Commissioning::Clock::time_point later(int seconds) {
  return Commissioning::Clock::now() + std::chrono::seconds(seconds);
}

}  // namespace

TEST_CASE("a repair, a change and new gains have one receipt, hours later") {
  Bench bench;
  bench.run(2);
  const auto go_on = [](std::chrono::milliseconds) { return false; };
  bench.reports.run_next(go_on);  // loads the reports
  const auto receipts = [&] {
    bench.operators.collect();
    return bench.reports.of("FIC-101").value();
  };
  json outcome{{"request", "outcome"}, {"found", "stiction"}, {"note", "packing"}};
  const auto tell = [&](const std::string& note) {
    outcome["note"] = note;
    bench.operators.answer("outcome", outcome, {.peer = "uid 0"});
  };
  outcome["loop"] = "FIC-101";
  tell("packing");
  CHECK(receipts().empty());
  tell("repaired; packing");
  REQUIRE(receipts().size() == 1);
  const reports::Report first = receipts()[0];
  CHECK(first.order.kind == reports::Kind::receipt);
  CHECK(first.order.due_ms == first.order.to_ms);
  CHECK(first.order.due_ms - bench.now_ms == 15'000'000);
  CHECK(bench.now_ms - first.order.from_ms == 28'800'000);
  bench.now_ms += 60'000;
  tell("changed: positioner gain 8 to 12");
  bench.now_ms += 60'000;
  CHECK(bench.order({{"request", "tune"}, {"kp", 3.0}, {"ki", 0.25}, {"kd", 0.0}}).at("ok") ==
        true);
  bench.run(2);
  REQUIRE(receipts().size() == 1);
  CHECK(receipts()[0].order.due_ms == first.order.due_ms + 120'000);
  CHECK(receipts()[0].order.from_ms == first.order.from_ms);
  CHECK_FALSE(bench.reports.run_next(go_on));
}

TEST_CASE("a loop in commissioning obeys only the holder of the session") {
  Bench bench;
  bench.run(2);
  const json taken = bench.commission();
  REQUIRE(taken.at("ok") == true);
  CHECK(bench.loops[0].channels->commissioned);
  CHECK(bench.commission().at("ok") == false);
  json set{{"request", "set"}, {"set_point", 42.0}};
  CHECK(bench.order(set).at("error").get<std::string>().find("out of service") !=
        std::string::npos);
  CHECK(bench.commands().empty());
  set["session"] = taken.at("session").get<std::uint64_t>() + 1;
  CHECK(bench.order(set).at("ok") == false);
  set["session"] = taken.at("session");
  CHECK(bench.order(set).at("ok") == true);
  CHECK(bench.commands().size() == 1);

  // Masters may write nothing meanwhile.
  console::PlantReadings readings(bench.plant(), bench.daemon);
  CHECK(readings.read_only(0));
  CHECK(bench.commission({{"end", true}}).at("ok") == false);
  CHECK(bench.commission({{"end", true}, {"session", taken.at("session")}}).at("ok") == true);
  CHECK_FALSE(readings.read_only(0));
  // The former holder has lost the session, and everybody may send commands.
  CHECK(bench.order(set).at("ok") == false);
  set.erase("session");
  CHECK(bench.order(set).at("ok") == true);
}

TEST_CASE("manual from anyone ends a commissioning, and the loop accepts no new test") {
  Bench bench;
  bench.run(2);
  const json taken = bench.commission();
  const json calm{{"request", "alarm"}, {"alarm", "stiction"}, {"action", "calm"}, {"reason", "x"}};
  CHECK(bench.order(calm).at("error").get<std::string>().find("out of service") !=
        std::string::npos);
  CHECK(bench.order({{"request", "set"}, {"mode", "auto"}}).at("ok") == false);
  REQUIRE(bench.order({{"request", "set"}, {"mode", "man"}}).at("ok") == true);
  // The former holder can't command the loop any more. The session ends once the loop's cycle has
  // taken manual.
  CHECK(bench.order({{"request", "set"}, {"output", 42.0}, {"session", taken.at("session")}})
            .at("error") == "the commissioning ends: somebody takes the loop back");
  CHECK(bench.loops[0].channels->commissioned);
  bench.run(1);
  bench.operators.collect();
  CHECK_FALSE(bench.loops[0].channels->commissioned);
  CHECK(rt::unpacked(bench.loops[0].channels->availability).mode == control::Mode::manual);
  CHECK(bench.commission({{"session", taken.at("session")}}).at("ok") == false);
}

TEST_CASE("a person's manual ends a commissioning even if the loop is in manual already") {
  Bench bench;
  bench.run(2);
  const json taken = bench.commission();
  bench.order({{"request", "set"}, {"mode", "man"}, {"session", taken.at("session")}});
  bench.run(1);
  bench.operators.collect();
  CHECK(bench.loops[0].channels->commissioned);
  SECTION("a person's") {
    REQUIRE(bench.order({{"request", "set"}, {"mode", "man"}}).at("ok") == true);
    bench.run(1);
    bench.operators.collect();
    CHECK_FALSE(bench.loops[0].channels->commissioned);
  }
  SECTION("but not that of a machine, which may repeat itself") {
    const json asked{{"request", "set"}, {"mode", "man"}, {"loop", "FIC-101"}};
    const json refused = json::parse(console::answer_line(asked.dump(), [&](const json& request) {
      return std::get<std::string>(
          bench.operators.answer("set", request, {console::SocketName::edge, "sparkplug"}));
    }));
    CHECK(refused.at("ok") == false);
    bench.run(1);
    bench.operators.collect();
    CHECK(bench.loops[0].channels->commissioned);
  }
}

TEST_CASE("a refused command leaves a commissioning unchanged") {
  Bench bench;
  bench.run(2);
  const json taken = bench.commission();
  const json refused =
      GENERATE(json{{"mode", "man"}, {"output", 999.0}}, json{{"mode", "man"}, {"jacket", "on"}},
               json{{"mode", "man"}, {"expect", {{"set_point", 77.0}}}},
               json{{"mode", "man"}, {"output", 20.0}, {"expect", {{"mode", "man"}}}});
  bench.stop_action(control::OutputAction::hold());
  json set = refused;
  set["request"] = "set";
  bench.order(set);
  bench.run(2);
  bench.operators.collect();
  CHECK(bench.loops[0].channels->commissioned);
  CHECK(rt::unpacked(bench.loops[0].channels->availability).mode == control::Mode::automatic);
  CHECK(bench.commission({{"session", taken.at("session")}}).at("ok") == true);
}

TEST_CASE("a command for the state in force is done, without a journal line") {
  Bench bench;
  bench.run(2);
  const auto lines = [&] {
    return bench.ask(R"({"request": "journal", "most": 50})").at("lines").size();
  };
  const auto done = [&](json set) {
    set["request"] = "set";
    const json answer = bench.order(set);
    REQUIRE(answer.at("ok") == true);
    bench.run(1);
    const json state =
        bench.order({{"request", "order"}, {"order", answer.at("order").get<int>()}});
    CHECK(state.at("state") == "done");
  };
  done({{"mode", "auto"}, {"set_point", 60.0}});
  done({{"mode", "man"}});
  done({{"output", 33.0}});
  bench.journal.wait_written(3, std::chrono::seconds(10));
  const std::size_t before = lines();
  REQUIRE(before == 3);
  for (int second = 0; second < 5; ++second) {
    done({{"mode", "man"}});
    done({{"mode", "man"}, {"output", 33.0}});
    const json tune{{"request", "tune"}, {"kp", 2.0}, {"ki", 0.5}, {"kd", 0.0}};
    CHECK(bench.order(tune).at("ok") == true);
    bench.run(1);
  }
  bench.run(20);
  CHECK(bench.io().written == Approx(33.0));
  CHECK(lines() == before);
}

TEST_CASE("commands are not withheld while a command for automatic is on its way") {
  Bench bench;
  bench.run(2);
  std::get<hal::modbus::LoopModbusSettings>(bench.loops[0].config.io).comm_loss = {
      .protection = hal::modbus::CommLossProtection::set_by_device,
      .watchdog = std::nullopt,
      .timeout_s = 2.0};
  const json session = bench.commission().at("session");
  bench.order({{"request", "set"}, {"mode", "man"}, {"session", session}});
  bench.run(1);
  CHECK(bench.order({{"request", "set"}, {"mode", "auto"}, {"session", session}}).at("ok") == true);
  CHECK(bench.commission({{"session", session}, {"withhold_s", 30.0}}).at("ok") == false);
  CHECK(bench.loops[0].channels->withheld_until_ns == 0);
  bench.run(1);
  CHECK(rt::unpacked(bench.loops[0].channels->availability).mode == control::Mode::automatic);
}

TEST_CASE("without a sign of life for a minute the output moves to the stop action") {
  Bench bench;
  bench.run(2);
  const bool value = GENERATE(true, false);
  const double stood = bench.io().written;
  bench.stop_action(value ? control::OutputAction::go_to(20.0) : control::OutputAction::hold());
  const json taken = bench.commission();
  bench.operators.collect(later(59));
  CHECK(bench.commands().empty());
  CHECK(bench.loops[0].channels->commissioned);
  bench.operators.collect(later(62));
  // The former holder has lost the session. It ends once the loop's cycle has taken the stop
  // action.
  CHECK(bench.commission({{"session", taken.at("session")}}).at("ok") == false);
  bench.operators.collect(later(62));
  CHECK(bench.loops[0].channels->commissioned);
  CHECK(bench.commissioning().at("ends_in_s") == 0.0);
  bench.run(1);
  bench.operators.collect(later(62));
  CHECK_FALSE(bench.loops[0].channels->commissioned);
  CHECK(bench.commissioning().is_null());
  CHECK(rt::unpacked(bench.loops[0].channels->availability).mode == control::Mode::manual);
  bench.run(20);
  CHECK(bench.io().written == Approx(value ? 20.0 : stood));
  bench.operators.collect(later(130));
  CHECK(bench.commands().empty());
}

TEST_CASE("a record ends with the commissioning in which it began, and after its time") {
  Bench bench;
  bench.run(2);
  const json start{{"request", "record"}, {"start", "trial"}};
  const auto file = [&] { return bench.historian.recorder().status(0).csv_file; };
  const auto ended = [&] { return test::eventually([&] { return file().empty(); }); };
  SECTION("without a sign of life") {
    bench.commission();
    REQUIRE(bench.order(start).at("ok") == true);
    bench.operators.collect(later(59));
    CHECK_FALSE(file().empty());
    bench.operators.collect(later(62));
    CHECK(ended());
  }
  SECTION("released, or taken back") {
    const json taken = bench.commission();
    REQUIRE(bench.order(start).at("ok") == true);
    if (GENERATE(true, false)) {
      bench.commission({{"end", true}, {"session", taken.at("session")}});
    } else {
      bench.order({{"request", "set"}, {"mode", "man"}});
      bench.run(1);
    }
    // The record ends although another commissioning has begun.
    bench.commission();
    bench.operators.collect();
    CHECK(ended());
  }
  SECTION("after its time, also in a loop without commissioning") {
    json limited = start;
    limited["at_most_s"] = 30.0;
    REQUIRE(bench.order(limited).at("ok") == true);
    bench.operators.collect(later(29));
    CHECK_FALSE(file().empty());
    bench.operators.collect(later(31));
    CHECK(ended());
  }
  SECTION("a record that a person began before, or stopped, is left to this person") {
    REQUIRE(bench.order(start).at("ok") == true);
    bench.commission();
    bench.operators.collect(later(3600));
    CHECK_FALSE(file().empty());
    json limited = start;
    limited["at_most_s"] = -1.0;
    CHECK(bench.order(limited).at("ok") == false);
  }
}

TEST_CASE("a refused stop action is tried again, and the loop is not released before") {
  Bench bench;
  bench.run(2);
  bench.stop_action(control::OutputAction::go_to(20.0));
  bench.commission();
  // A fault's action has the output.
  bench.io().set_pv(50.0, hal::Quality::bad);
  bench.run(20);
  for (const int seconds : {62, 64, 66}) {
    bench.operators.collect(later(seconds));
    bench.run(1);
    CHECK(bench.loops[0].channels->commissioned);
  }
  CHECK(rt::unpacked(bench.loops[0].channels->availability).mode == control::Mode::manual);
  CHECK(bench.order({{"request", "set"}, {"set_point", 42.0}}).at("ok") == false);
  bench.io().set_pv(50.0);
  bench.run(20);
  bench.operators.collect(later(68));
  bench.run(1);
  bench.operators.collect(later(68));
  CHECK_FALSE(bench.loops[0].channels->commissioned);
  bench.run(20);
  CHECK(bench.io().written == Approx(20.0));
}

TEST_CASE("a master's manual ends a commissioning like a person's") {
  Bench bench;
  bench.run(2);
  const json taken = bench.commission();
  bench.loops[0].channels->withheld_until_ns = INT64_MAX;
  GatewayLoops gateway(bench.plant(), bench.journal, bench.daemon);
  CHECK(gateway.read_only(0));
  journal::JournalEntry line;
  line.peer = "10.0.0.9";
  gateway.send(0, {.mode = control::Mode::manual, .ends_commissioning = true}, {line});
  CHECK(gateway.read_only(0));  // its cycle has not taken it yet
  bench.run(1);
  gateway.collect_answers();
  CHECK_FALSE(gateway.read_only(0));
  CHECK(bench.loops[0].channels->withheld_until_ns == 0);
  CHECK(bench.commission({{"session", taken.at("session")}}).at("ok") == false);
  CHECK(bench.commissioning().is_null());
}

TEST_CASE("the status has the holder of a commissioning, and its start") {
  Bench bench;
  bench.run(2);
  CHECK(bench.commissioning().is_null());
  const auto column = [&] { return bench.ask(R"({"request": "overview"})").at("commissioned")[0]; };
  CHECK(column() == 0);
  bench.commission();
  const json now = bench.commissioning();
  CHECK(now.at("by") == "uid 0");
  CHECK(now.at("since_ms") == bench.now_ms);
  CHECK(now.at("ends_in_s") > 50.0);
  CHECK(column() == 1);
}

TEST_CASE("commands are withheld only for their time, in manual, if a device watches") {
  Bench bench;
  bench.run(2);
  const json session = bench.commission().at("session");
  const json hold{{"session", session}, {"withhold_s", 5.0}};
  CHECK(bench.commission(hold).at("ok") == false);  // in automatic
  bench.order({{"request", "set"}, {"mode", "man"}, {"session", session}});
  bench.run(1);
  CHECK(bench.commission(hold).at("ok") == false);  // no watchdog
  std::get<hal::modbus::LoopModbusSettings>(bench.loops[0].config.io).comm_loss = {
      .protection = hal::modbus::CommLossProtection::set_by_device,
      .watchdog = std::nullopt,
      .timeout_s = 2.0};
  CHECK(bench.commission({{"session", session}, {"withhold_s", 301.0}}).at("ok") == false);
  const std::int64_t before_ns = base::MonotonicClock().now_ns();
  REQUIRE(bench.commission(hold).at("ok") == true);
  const std::int64_t until_ns = bench.loops[0].channels->withheld_until_ns;
  CHECK(until_ns >= before_ns + 5'000'000'000);
  CHECK(until_ns < before_ns + 7'000'000'000);
  bench.commission({{"session", session}, {"end", true}});
  CHECK(bench.loops[0].channels->withheld_until_ns == 0);
}

TEST_CASE("while commands are withheld the device gets no command, except the last at a stop") {
  Bench bench;
  auto& io = dynamic_cast<tests::FakeLoopIo&>(*bench.loops[0].io);
  bench.order({{"request", "set"}, {"mode", "man"}});
  bench.run(3);
  const std::uint64_t before = io.writes;
  REQUIRE(before > 0);
  bench.loops[0].channels->withheld_until_ns =
      static_cast<std::int64_t>(bench.cycles_run + 3) * tests::kPeriodNs;
  bench.run(2);
  CHECK(io.writes == before);
  bench.run(1);
  CHECK(io.writes == before + 1);
  bench.loops[0].channels->withheld_until_ns = INT64_MAX;
  bench.cycle->run({.now_ns = static_cast<std::int64_t>(++bench.cycles_run) * tests::kPeriodNs,
                    .period_index = bench.cycles_run},
                   0, true);
  CHECK(io.writes == before + 2);
}

}  // namespace loopwarden::daemon::operator_commands_test
