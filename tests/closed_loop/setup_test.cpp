// SPDX-License-Identifier: Apache-2.0
// The steps of `loopwarden setup` that move a valve, and the reading of registers, with the real daemon on a device that this
// project didn't write (pymodbus).
#include <catch2/catch.hpp>

#include <cmath>
#include <string>

#include "tests/hal/modbus/modbus_rig.hpp"
#include "tests/support/daemon_process.hpp"
#include "tests/support/shell.hpp"
#include "tests/workbench/setup/scripted_setup.hpp"
#include "workbench/live/test_bench.hpp"
#include "workbench/setup/moving.hpp"

namespace loopwarden::tests::setup_test {
namespace {

using setup::Outcome;

constexpr const char* kLoop = R"(
loop: FIC-101
sample_time: 0.05
process_variable: {unit: L/min, range: [0, 10]}
controller:
  action: ACTION
  kp: 0.3494
  ki: 0.4
  set_point: {limits: [0, 9]}
  output: {unit: V, range: [0, 10]}
  set_point_tracks_in_manual: true
start: {mode: manual, set_point: 5}
safe_actions: {stop: 2, bad_pv: hold, output_lost: hold, late_cycle_periods: 40, enable_open: hold, recovery: manual, recovery_delay: 0.2}
io:
  backend: modbus
  poll_period: 0.05
  transmitter: {link: field, unit: 1, register: {table: input, address: 0, type: f32}}
  positioner:
    link: field
    unit: 1
    command: {address: 0, type: f32}
    read_back: {table: input, address: 20, type: f32}
    comm_loss: LOSS
)";
constexpr const char* kWatchdog =
    "{timeout: 2, register: {address: 10, type: u16, scale: 0.1}, value: 2}";

std::string loop_text(std::string action, const std::string& loss) {
  std::string text = kLoop;
  text.replace(text.find("ACTION"), 6, action);
  return text.replace(text.find("LOSS"), 4, loss);
}

// The plant at ten times its speed, its valve at 4 V, its fail-safe position 0.5 V.
struct Plant {
  explicit Plant(const std::string& loop = loop_text("reverse", kWatchdog))
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

TEST_CASE("a stroke moves the valve through its limits and puts it back", "[setup]") {
  Plant plant;
  plant.start();
  ScriptedPerson& person = plant.s.person;
  person.lines = {"FIC-101", "2 8", "0 10", "1.5"};
  CHECK(setup::stroke_valve(plant.s.all) == Outcome::done);
  INFO(person.said);
  CHECK(person.told("CO 2 V"));
  CHECK(person.told("CO 8 V"));
  CHECK(person.told("PV rises"));
  CHECK_FALSE(person.watches);
  CHECK(test::eventually([&] { return std::abs(plant.co() - 4.0) < 0.05; }));
  CHECK(plant.served());
}

TEST_CASE("a stroke finds an action that is the wrong way round", "[setup]") {
  Plant plant(loop_text("direct", kWatchdog));
  plant.start();
  plant.s.person.lines = {"FIC-101", "2 8", "0 10", "1"};
  CHECK_THROWS_WITH(setup::stroke_valve(plant.s.all), Catch::Contains("action must be reverse"));
}

TEST_CASE("nothing moves without the tag, a terminal, or with a key pressed", "[setup]") {
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
    CHECK(person.told("outside"));
  }
  CHECK(test::eventually([&] { return std::abs(plant.co() - before) < 0.05; }));
  CHECK(plant.served());
}

TEST_CASE("a device's watchdog runs out, and the output is put back", "[setup]") {
  Plant plant;
  plant.start();
  const double trips = plant.device.state_number("trips");
  ScriptedPerson& person = plant.s.person;
  person.lines = {"FIC-101", "0.5", "2 8", "0 10", "6"};
  const Outcome outcome = setup::test_watchdog(plant.s.all);
  INFO(person.said);
  CHECK(outcome == Outcome::done);
  CHECK(plant.device.state_number("trips") == trips + 1);
  CHECK(person.told("to 0.5 V"));
  CHECK(test::eventually([&] { return std::abs(plant.co() - 4.0) < 0.05; }));
  CHECK(plant.served());
}

TEST_CASE("a watchdog that does not act is found", "[setup]") {
  // The file says that the device has one; its register was never set.
  Plant plant(loop_text("reverse", "{timeout: 1, set_by: device}"));
  plant.start();
  plant.s.person.lines = {"FIC-101", "0.5", "2 8", "0 10", "6"};
  CHECK_THROWS_WITH(setup::test_watchdog(plant.s.all), Catch::Contains("did not move"));
  CHECK(plant.device.state_number("trips") == 0.0);
  CHECK(plant.served());
}

TEST_CASE("a record has the moves of the set point, and the loop is in manual after it",
          "[setup]") {
  Plant plant;
  plant.start();
  plant.s.all.record_minutes = 0.4;
  plant.s.person.lines = {"FIC-101", "5", "0.4", "1 9"};
  const Outcome outcome = setup::record_moves(plant.s.all);
  INFO(plant.s.person.said);
  REQUIRE(outcome == Outcome::done);
  const std::string text = read_file(plant.s.state.found("record"));
  CHECK(text.find(",5.4,") != std::string::npos);
  CHECK(text.find(",4.6,") != std::string::npos);
  // By the loop's next cycle.
  CHECK(test::eventually([&] { return plant.daemon.is("FIC-101", "requested_mode", "MAN"); }));
  CHECK(plant.served());
}

TEST_CASE("registers are read where no loop runs, and left alone where one does", "[setup]") {
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
  const nlohmann::json refused = nlohmann::json::parse(ask(probe).text);
  CHECK(refused.at("state") == "refused");
  CHECK(refused.at("why") == "FIC-101 runs on it");
}

}  // namespace loopwarden::tests::setup_test
