// SPDX-License-Identifier: Apache-2.0
// The steps of `loopwarden setup` that move a valve, and the reading of registers. The real daemon
// runs on a device that this project didn't write (pymodbus).
#include <catch2/catch.hpp>

#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/hal/modbus/modbus_rig.hpp"
#include "tests/support/daemon_process.hpp"
#include "tests/support/device/plant_loop.hpp"
#include "tests/support/shell.hpp"
#include "tests/workbench/setup/scripted_setup.hpp"
#include "workbench/live/test_bench.hpp"
#include "workbench/setup/moving.hpp"

namespace loopwarden::tests::setup_test {
namespace {

using setup::Outcome;

const std::string kReadBack = "    read_back: {table: input, address: 20, type: f32}\n";

// In manual, with a watchdog of 2 s.
std::string loop_text() {
  std::string text = plant_loop("field", 2.0);
  text =
      with(text, "{mode: automatic, set_point: 5, output: hold}", "{mode: manual, set_point: 5}");
  return with(text, "recovery: previous_mode", "late_cycle_periods: 40\n  recovery: manual");
}

// According to the file the device has a watchdog, but its register was never set.
std::string without_watchdog(const std::string& text) {
  return with(text,
              "{timeout: 2, register: {address: 10, type: u16, scale: 0.1},\n"
              "                 value: 2}",
              "{timeout: 1, set_by: device}");
}

// The position of the valve is unknown.
std::string blind(const std::string& text) {
  return with(with(text, kReadBack, ""), "set_point: 5}", "set_point: 5, output: 4}");
}

// The plant at ten times its speed, its valve at 4 V, its fail-safe position 0.5 V.
struct Plant {
  explicit Plant(const std::string& loop = loop_text())
      : device("plant_device.py", {"--speed", "10", "--fail-safe", "0.5", "--start", "4"}),
        daemon("links: {field: {transport: tcp, host: 127.0.0.1, port: " + device.ready("port") +
                   "}}\n",
               {{"loops.d/FIC-101.yaml", loop}}) {
    s.state.answer("control", "here");
    s.all.folder = daemon.config();
    s.all.socket = (daemon.folder() / "control.sock").string();
  }
  void start() {
    daemon.start();
    REQUIRE(test::eventually([&] {
      const auto now = daemon.loop("FIC-101");
      return now.value("fault", "") == "none" && now.at("pv").is_number() && co() > 3.9;
    }));
  }
  double co() { return device.state_number("co"); }
  bool back() {
    return test::eventually([&] { return std::abs(co() - 4.0) < 0.05; });
  }
  bool commissioned() { return !daemon.loop("FIC-101").at("commissioning").is_null(); }
  bool served() {
    try {
      daemon.client().set({.loop = "FIC-101", .mode = "man"});
      return true;
    } catch (const workbench::DaemonRefused&) {
      return false;
    }
  }

  test::ForeignProcess device;
  DaemonProcess daemon;
  ScriptedSetup s;
};

}  // namespace

TEST_CASE("a stroke moves the valve through its limits and restores the output", "[setup]") {
  Plant plant;
  plant.start();
  ScriptedPerson& person = plant.s.person;
  person.lines = {"FIC-101", "2 8", "0 10", "1.5"};
  CHECK(setup::stroke_valve(plant.s.all) == Outcome::done);
  INFO(person.said);
  CHECK(person.told("CO 2 V"));
  CHECK(person.told("CO 8 V"));
  CHECK(person.told("PV rises"));
  // The stroke makes no jump in either direction: a quarter of the limits at most.
  const std::vector<double> co = plant.daemon.trend("FIC-101").co;
  for (std::size_t i = 1; i < co.size(); ++i) CHECK(std::abs(co[i] - co[i - 1]) < 1.51);
  CHECK_FALSE(person.watches);
  CHECK(plant.back());
  CHECK(plant.served());
}

TEST_CASE("a stroke finds an action that is the wrong way round", "[setup]") {
  Plant plant(with(loop_text(), "reverse", "direct"));
  plant.start();
  plant.s.person.lines = {"FIC-101", "2 8", "0 10", "1"};
  CHECK_THROWS_WITH(setup::stroke_valve(plant.s.all), Catch::Contains("action must be reverse"));
  // With this action a record does not change to automatic, though the stroke is left open.
  CHECK(plant.back());
  plant.s.person.lines = {"FIC-101"};
  CHECK_THROWS_WITH(setup::record_moves(plant.s.all),
                    Catch::Contains("the stroke has shown that controller.action must be reverse"));
  CHECK(plant.back());
}

TEST_CASE("the valve doesn't move without the tag, a terminal, or with a key pressed", "[setup]") {
  Plant plant;
  plant.start();
  ScriptedPerson& person = plant.s.person;
  const double before = plant.co();
  SECTION("no tag") {
    person.lines = {"FIC-102", ""};
    CHECK(setup::stroke_valve(plant.s.all) == Outcome::left);
  }
  SECTION("no terminal") {
    person.keys = false;
    person.lines = {"FIC-101", "2 8", "0 10", "1"};
    CHECK_THROWS_AS(setup::stroke_valve(plant.s.all), workbench::TestAborted);
  }
  SECTION("a key") {
    person.lines = {"FIC-101", "2 8", "0 10", "1"};
    person.next_key = 'x';
    CHECK_THROWS_AS(setup::stroke_valve(plant.s.all), workbench::TestAborted);
  }
  SECTION("limits that leave the loop outside") {
    person.lines = {"FIC-101", "5 8", "0 10"};
    CHECK_THROWS_AS(setup::stroke_valve(plant.s.all), setup::Paused);
    CHECK(person.told("CO is 4 V now, outside of its limits 5 to 8 V"));
  }
  CHECK(test::eventually([&] { return std::abs(plant.co() - before) < 0.05; }));
  CHECK(plant.served());
}

TEST_CASE("a device's watchdog runs out, and the output is restored", "[setup]") {
  Plant plant;
  plant.start();
  const double trips = plant.device.state_number("trips");
  ScriptedPerson& person = plant.s.person;
  person.lines = {"FIC-101", "0.5 V", "2 8 V", "0 10", "5 bar", "6 V"};
  const Outcome outcome = setup::test_watchdog(plant.s.all);
  INFO(person.said);
  CHECK(outcome == Outcome::done);
  CHECK(plant.device.state_number("trips") == trips + 1);
  CHECK(person.told("to 0.5 V"));
  CHECK(plant.back());
  CHECK(plant.served());
}

TEST_CASE("a watchdog that does not act is found", "[setup]") {
  Plant plant(without_watchdog(loop_text()));
  plant.start();
  plant.s.person.lines = {"FIC-101", "0.5", "2 8", "0 10", "6"};
  CHECK_THROWS_WITH(setup::test_watchdog(plant.s.all), Catch::Contains("did not move"));
  CHECK(plant.device.state_number("trips") == 0.0);
  CHECK(plant.served());
}

TEST_CASE("a valve that moves for another reason is no proof of a watchdog", "[setup]") {
  Plant plant(without_watchdog(blind(loop_text())));
  plant.start();
  ScriptedPerson& person = plant.s.person;
  person.lines = {"FIC-101", "0.5", "2 8", "0 10", "6", "0.5"};
  const char* pv = GENERATE("1", "briefly");
  person.hears = [&](const std::string& text) {
    if (text.find("cease now") == std::string::npos) return;
    plant.device.command(std::string("pv ") + "1");
    if (std::string(pv) == "briefly") {
      REQUIRE(test::eventually([&] { return plant.daemon.loop("FIC-101").at("pv") == 1.0; }));
      plant.device.command("pv auto");
    }
  };
  CHECK_THROWS_WITH(setup::test_watchdog(plant.s.all),
                    Catch::Contains("continues to read") &&
                        Catch::Contains(std::string(pv) == "1" ? "too soon" : "did not move"));
  CHECK(plant.s.state.found("watchdog").empty());
}

TEST_CASE("without a read-back, a person enters where the watchdog moved the valve", "[setup]") {
  Plant plant(blind(loop_text()));
  plant.start();
  ScriptedPerson& person = plant.s.person;
  const std::string seen = GENERATE("0.5", "6");
  person.lines = {"FIC-101", "0.5", "2 8", "0 10", "6", seen};
  if (seen == "0.5") {
    CHECK(setup::test_watchdog(plant.s.all) == Outcome::done);
    CHECK(person.told("watch it"));
    CHECK(person.told("to 0.5 V as seen by eye"));
  } else {
    CHECK_THROWS_WITH(setup::test_watchdog(plant.s.all), Catch::Contains("not to 0.5"));
  }
  CHECK(plant.back());
}

TEST_CASE("a key, and PV beyond its limits, end the wait for the output, which is restored",
          "[setup]") {
  Plant plant(with(loop_text(), "recovery_delay: 0.3", "recovery_delay: 8"));
  plant.start();
  ScriptedPerson& person = plant.s.person;
  person.lines = {"FIC-101", "0.5", "2 8", "-1 9", "6"};
  const bool key = GENERATE(true, false);
  person.hears = [&](const std::string& text) {
    if (text.find("go out again") == std::string::npos) return;
    // The output is lost again, and returns 8 s after its cause.
    plant.device.command("restart 3");
    REQUIRE(test::eventually([&] { return !plant.daemon.is("FIC-101", "fault", "none"); }));
    if (key) {
      person.next_key = 'x';
    } else {
      plant.device.command("pv 9.5");
      REQUIRE(test::eventually([&] { return plant.daemon.loop("FIC-101").at("pv") == 9.5; }));
    }
  };
  CHECK_THROWS_WITH(setup::test_watchdog(plant.s.all),
                    Catch::Contains(key ? "a key was pressed" : "PV 9.5 left its limits"));
  CHECK(plant.back());
  CHECK_FALSE(plant.commissioned());
}

TEST_CASE("a loop that can't be restored is not released, and the reason for the end is reported",
          "[setup]") {
  Plant plant;
  plant.start();
  ScriptedPerson& person = plant.s.person;
  person.lines = {"FIC-101", "0.5", "2 8", "0 10", "6"};
  person.hears = [&](const std::string& text) {
    if (text.find("cease now") == std::string::npos) return;
    plant.device.freeze();
    REQUIRE(test::eventually([&] { return !plant.daemon.is("FIC-101", "fault", "none"); }));
    person.next_key = 'x';
  };
  CHECK_THROWS_WITH(setup::test_watchdog(plant.s.all),
                    Catch::Contains("a key was pressed; the loop does not get its output back"));
  const nlohmann::json loop = plant.daemon.loop("FIC-101");
  REQUIRE(loop.at("commissioning").is_object());
  CHECK(loop.at("commissioning").at("ends_in_s") > 0.0);
}

TEST_CASE("while a fault's action has the output, a loop that is not restored is not released",
          "[setup]") {
  Plant plant(with(loop_text(), "output_lost: hold", "output_lost: 3"));
  plant.start();
  ScriptedPerson& person = plant.s.person;
  person.lines = {"FIC-101", "2 8", "0 10", "1.5"};
  person.hears = [&](const std::string& text) {
    if (text.find("CO 2 V") == std::string::npos) return;
    plant.device.freeze();
    REQUIRE(test::eventually([&] { return !plant.daemon.is("FIC-101", "fault", "none"); }));
  };
  CHECK_THROWS_AS(setup::stroke_valve(plant.s.all), workbench::TestAborted);
  CHECK(plant.commissioned());
}

TEST_CASE("a loop in commissioning is shown, a reload is refused, and manual ends it", "[setup]") {
  Plant plant;
  plant.start();
  const std::string socket = " --socket " + plant.s.all.socket;
  setup::Session session(plant.s.all.socket, "FIC-101");
  CHECK_THAT(bash(LOOPWARDEN_CLI " top --once FIC-101" + socket).text,
             Catch::Contains("in maintenance by uid") && Catch::Contains("since 20"));
  const ShellOutcome reload = bash(LOOPWARDEN_CLI " reload" + socket + " 2>&1");
  CHECK(reload.exit_code == 65);
  CHECK_THAT(reload.text, Catch::Contains("FIC-101 is in maintenance by uid") &&
                              Catch::Contains("nothing has changed"));
  CHECK(bash(LOOPWARDEN_CLI " set FIC-101 --mode man" + socket).exit_code == 0);
  CHECK_FALSE(plant.commissioned());
  CHECK(bash(LOOPWARDEN_CLI " reload" + socket).exit_code == 0);
}

TEST_CASE("a record has the moves of the set point, and the loop is in manual after it",
          "[setup]") {
  Plant plant;
  plant.start();
  plant.s.all.record_minutes = 0.4;
  plant.s.person.lines = {"FIC-101", "5", "0.4", "2 8", "1 9"};
  const Outcome outcome = setup::record_moves(plant.s.all);
  INFO(plant.s.person.said);
  REQUIRE(outcome == Outcome::done);
  const std::string text = read_file(plant.s.state.found("record"));
  CHECK(text.find(",5.4,") != std::string::npos);
  CHECK(text.find(",4.6,") != std::string::npos);
  // Done by the loop's next cycle.
  CHECK(test::eventually([&] { return plant.daemon.is("FIC-101", "requested_mode", "MAN"); }));
  CHECK(plant.served());
}

TEST_CASE("the valve doesn't move with a file that is not in force", "[setup]") {
  Plant plant;
  plant.start();
  const double before = plant.co();
  const std::string file = GENERATE(std::string("action"), std::string("comment"),
                                    std::string("link"), std::string("unreadable"));
  if (file == "action") {
    plant.daemon.write_config("loops.d/FIC-101.yaml", with(loop_text(), "reverse", "direct"));
  } else if (file == "comment") {
    plant.s.all.folder = plant.daemon.folder() / "other";
    write_file(plant.s.all.folder / "loopwardend.yaml",
               read_file(plant.daemon.config() / "loopwardend.yaml"));
    write_file(plant.s.all.loop_file(), loop_text() + "# of another folder\n");
  } else if (file == "link") {
    const auto path = plant.daemon.config() / "loopwardend.yaml";
    write_file(path, with(read_file(path), "transport: tcp,", "transport: tcp, pause: 0.01,"));
  } else {
    plant.daemon.write_config("loops.d/FIC-101.yaml", "loop: [");
  }
  const std::string told = file == "action"    ? "controller.action reverse in force, direct"
                           : file == "comment" ? "different text"
                           : file == "link"    ? "is not in force: links.field"
                                               : "the daemon refuses its files";
  const auto refused = [&](setup::Step step) {
    plant.s.person.lines = {"FIC-101", "2 8", "0 10", "1", "5", "0.4", "2 8", "1 9"};
    if (file == "unreadable") {
      CHECK_THROWS(step(plant.s.all));
    } else {
      CHECK_THROWS_WITH(step(plant.s.all), Catch::Contains(told));
    }
    CHECK_FALSE(plant.commissioned());
  };
  refused(setup::stroke_valve);
  refused(setup::test_watchdog);
  refused(setup::record_moves);
  if (file != "comment") {
    const ShellOutcome test =
        bash(LOOPWARDEN_CLI
             " valve-test FIC-101 --live --low 2 --high 8 --pv-low 0 --pv-high 10 "
             "--socket " +
             plant.s.all.socket + " 2>&1");
    CHECK(test.exit_code == 75);
    CHECK_THAT(test.text, Catch::Contains(told));
  }
  // The step `start` waits until the file is in force.
  plant.s.person.lines = {};
  CHECK_THROWS_AS(setup::start_loop(plant.s.all), setup::Paused);
  CHECK(plant.co() == Approx(before).margin(0.05));
  if (file != "action") return;
  REQUIRE(bash(LOOPWARDEN_CLI " reload --socket " + plant.s.all.socket).exit_code == 0);
  plant.s.person.lines = {"FIC-101", "2 8", "0 10", "1"};
  CHECK_THROWS_WITH(setup::stroke_valve(plant.s.all), Catch::Contains("action must be reverse"));
}

TEST_CASE("gains that a person has set are in force over the file", "[setup]") {
  Plant plant;
  plant.start();
  protocol::ask(plant.daemon.client(),
                protocol::TuneRequest{.loop = "FIC-101", .kp = 0.3, .ki = 0.3, .kd = 0.0});
  REQUIRE(test::eventually(
      [&] { return plant.daemon.loop("FIC-101").at("gains").at("not_in_file") == true; }));
  plant.s.person.lines = {"FIC-101", "2 8", "0 10", "1"};
  CHECK(setup::stroke_valve(plant.s.all) == Outcome::done);
}

TEST_CASE("a record that ends at a limit, by a key or a fault restores the output", "[setup]") {
  const std::string ends = GENERATE(as<std::string>(), "CO", "PV", "key", "operator");
  // With the wrong action the loop runs away.
  const bool wrong = ends == "CO" || ends == "PV";
  Plant plant(wrong ? with(loop_text(), "reverse", "direct") : loop_text());
  plant.start();
  ScriptedPerson& person = plant.s.person;
  person.lines = {"FIC-101", "4.5", "0.4", ends == "CO" ? "3 6" : "0 10",
                  ends == "PV" ? "4 5.8" : "0 10"};
  person.hears = [&](const std::string& text) {
    if (text.find("Set point goes") == std::string::npos) return;
    if (ends == "key") person.next_key = 'x';
    if (ends == "operator") plant.daemon.client().set({.loop = "FIC-101", .mode = "man"});
  };
  const std::string why = ends == "key"        ? "a key was pressed"
                          : ends == "operator" ? ""
                                               : ends + " ";
  if (ends == "operator") {
    CHECK_THROWS(setup::record_moves(plant.s.all));
  } else {
    CHECK_THROWS_WITH(setup::record_moves(plant.s.all), Catch::Contains(why));
    CHECK(person.told("output back to 4"));
    CHECK(plant.back());
  }
  CHECK(test::eventually([&] { return plant.daemon.is("FIC-101", "requested_mode", "MAN"); }));
  CHECK_FALSE(plant.commissioned());
}

TEST_CASE("a record does not begin outside of its limits", "[setup]") {
  Plant plant;
  plant.start();
  ScriptedPerson& person = plant.s.person;
  const bool pv = GENERATE(true, false);
  // PV is near 5, the output at 4.
  person.lines = {"FIC-101", "5", "0.4", pv ? "2 8" : "5 8", pv ? "6 9" : "1 9"};
  CHECK_THROWS_AS(setup::record_moves(plant.s.all), setup::Paused);
  CHECK(person.told("outside"));
  CHECK(test::eventually([&] { return plant.daemon.is("FIC-101", "requested_mode", "MAN"); }));
  CHECK_FALSE(plant.commissioned());
  person.lines = {"FIC-101", "8.9", "0.4", "2 8", "1 9.9"};
  CHECK_THROWS_WITH(setup::record_moves(plant.s.all), Catch::Contains("limits of the set point"));
}

TEST_CASE("a record is not made with another action than that of the stroke", "[setup]") {
  Plant plant;
  plant.start();
  plant.s.state.set_step("stroke", "done");
  plant.s.state.set_found("action", "direct");
  plant.s.person.lines = {"FIC-101", "5", "0.4", "2 8", "1 9"};
  CHECK_THROWS_WITH(setup::record_moves(plant.s.all), Catch::Contains("--again stroke"));
}

TEST_CASE("registers are read only if no loop runs on them", "[setup]") {
  Plant plant;
  const std::string probe = R"({"transport":"tcp","host":"127.0.0.1","port":)" +
                            plant.device.ready("port") +
                            R"(,"unit":1,"table":"input","address":100,"type":"f32"})";
  const auto ask = [&](const std::string& line) {
    const auto file = plant.daemon.folder() / "asked";
    write_file(file, line + "\n");
    return bash(LOOPWARDEN_BIN_DIR "/loopwardend --probe --config " +
                plant.daemon.config().string() + " < " + file.string());
  };
  const ShellOutcome read = ask(probe);
  CHECK(read.exit_code == 0);
  CHECK(nlohmann::json::parse(read.text).at("raw") == 123456.0);
  CHECK(ask("{}").text.find("refused") != std::string::npos);
  CHECK(ask("no json").text.find("refused") != std::string::npos);
  std::string absent = probe;
  absent.replace(absent.find("100"), 3, "500");
  CHECK(nlohmann::json::parse(ask(absent).text).at("state") == "error");
  plant.start();
  const auto is_refused = [&](const std::string& line) {
    const nlohmann::json answer = nlohmann::json::parse(ask(line).text);
    CHECK(answer.at("state") == "refused");
    CHECK(answer.at("why") == "FIC-101 runs on it");
  };
  is_refused(probe);
  is_refused(with(probe, "127.0.0.1", "localhost"));
  is_refused(with(probe, "127.0.0.1", "::ffff:127.0.0.1"));
  // By the running configuration, whatever the present files contain.
  std::filesystem::remove(plant.daemon.config() / "loops.d/FIC-101.yaml");
  is_refused(probe);
}

}  // namespace loopwarden::tests::setup_test
