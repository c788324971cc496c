// SPDX-License-Identifier: Apache-2.0
// The real daemon on a device that this project didn't write (pymodbus), through the faults of a
// plant. Each case ends with a check of the output on the device.
#include <catch2/catch.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "tests/hal/modbus/modbus_rig.hpp"
#include "tests/support/daemon_process.hpp"
#include "tests/support/device/plant_loop.hpp"
#include "tests/support/shell.hpp"

namespace loopwarden::tests::modbus_faults_test {
namespace {

using test::eventually;
using test::SerialRig;
using test::TcpRig;

// Outputs that distinguish the cases, CO units.
constexpr double kStop = 2.0;
constexpr double kBadPv = 1.5;
constexpr double kDeviceFailSafe = 0.5;
constexpr double kSetPoint = 5.0;
const std::vector<std::string> kDeviceArguments{"--speed", "10",      "--fail-safe",
                                                "0.5",     "--start", "3"};

std::string tcp_link_yaml(const std::string& name, const std::string& port,
                          double response_timeout_s = 0.4) {
  return fmt::format(
      "  {}: {{transport: tcp, host: 127.0.0.1, port: {}, response_timeout: {}, reconnect_min: "
      "0.05, reconnect_max: 0.3}}\n",
      name, port, response_timeout_s);
}

constexpr std::chrono::seconds kSettling{120};

// Daemon, device and a proxy that can spoil the replies, on TCP.
struct TcpPlant {
  explicit TcpPlant(const std::string& loop = plant_loop("field", 1.0))
      : rig(kDeviceArguments),
        daemon("links:\n" + tcp_link_yaml("field", rig.proxy.ready("port")),
               {{"loops.d/FIC-101.yaml", loop}}) {}

  double co() { return rig.device.state_number("co"); }
  double pv() { return rig.device.state_number("pv"); }
  bool in_automatic() {
    return daemon.is("FIC-101", "mode", "AUTO") && daemon.is("FIC-101", "fault", "none");
  }
  bool at_set_point() { return in_automatic() && std::abs(pv() - kSetPoint) < 0.2; }
  // Starts the daemon and waits until the loop has settled.
  void settle() {
    daemon.start();
    REQUIRE(eventually([&] { return at_set_point(); }, kSettling));
  }
  bool output_at(double value) {
    return eventually([&] { return std::abs(co() - value) < 0.01; });
  }
  // Checks the recovery after the fault: back in automatic, and the output did not jump on the way.
  void recovers() {
    using Clock = std::chrono::steady_clock;
    Clock::time_point before_last = Clock::now();
    double last = co();
    std::string trips = rig.device.state("trips");
    double worst = 0.0;
    const bool back = eventually(
        [&] {
          const Clock::time_point before = Clock::now();
          // A change by the device's own watchdog, which may act late and between two looks, is no
          // jump.
          const std::string state = rig.device.command("state");
          const std::string trips_now = test::ForeignProcess::field(state, "trips");
          const bool tripped_since = std::exchange(trips, trips_now) != trips_now;
          const bool by_device =
              tripped_since || test::ForeignProcess::field(state, "watchdog") == "tripped";
          const double now = std::stod(test::ForeignProcess::field(state, "co"));
          // The time from before the last look to after this one, for any delay of this test.
          const double passed_s = std::chrono::duration<double>(Clock::now() - before_last).count();
          // The change that the rate limit of 5 V/s allows in that time, plus a period of the loop
          // and the bus.
          if (!by_device) worst = std::max(worst, std::abs(now - last) - 5.0 * (passed_s + 0.1));
          last = now;
          before_last = before;
          return at_set_point();
        },
        kSettling);
    CHECK(back);
    CHECK(worst <= 0.0);
    CHECK(rig.device.state("unguarded_writes") == "0");
  }

  TcpRig rig;
  DaemonProcess daemon;
};

TEST_CASE("the daemon controls a foreign device over TCP to the set point") {
  TcpPlant plant;
  plant.settle();
  plant.daemon.client().set({.loop = "FIC-101", .set_point = 6.0});
  CHECK(eventually([&] { return std::abs(plant.pv() - 6.0) < 0.2; }, kSettling));
  CHECK(plant.rig.device.state("watchdog") == "ok");
  CHECK(plant.rig.device.state("watchdog_register") == "10");
}

TEST_CASE("the daemon controls a foreign device over a serial line to the set point") {
  SerialRig rig(kDeviceArguments);
  DaemonProcess daemon(
      fmt::format("links:\n  line: {{transport: rtu, device: {}, baud: 115200, parity: none, "
                  "response_timeout: 2, reconnect_min: 0.05, reconnect_max: 0.3}}\n",
                  rig.proxy.ready("master")),
      {{"loops.d/FIC-101.yaml", plant_loop("line", 6.0, "FIC-101", 0.1, 3.0)}});
  daemon.start();
  const bool settled = eventually(
      [&] { return std::abs(rig.device.state_number("pv") - kSetPoint) < 0.2; }, kSettling);
  INFO(daemon.loop("FIC-101").dump(1) << daemon.log() << rig.device.state("writes"));
  REQUIRE(settled);

  // A late reply, and the loop is back with fresh values afterwards.
  rig.proxy.command("late 3000 1");
  CHECK(eventually([&] { return daemon.loop("FIC-101")["io"]["timeouts"].get<int>() > 0; }));
  CHECK(eventually(
      [&] {
        return daemon.is("FIC-101", "mode", "AUTO") &&
               std::abs(rig.device.state_number("pv") - kSetPoint) < 0.2;
      },
      kSettling));

  // The line falls silent: only the device itself can act, and it does.
  rig.proxy.command("silent");
  CHECK(
      eventually([&] { return std::abs(rig.device.state_number("co") - kDeviceFailSafe) < 0.01; }));
  rig.proxy.command("ok");
  CHECK(eventually([&] { return std::abs(rig.device.state_number("pv") - kSetPoint) < 0.2; },
                   kSettling));
  CHECK(rig.device.state("unguarded_writes") == "0");
}

TEST_CASE("fault, transmitter: failure, NaN and out of range send the output to the bad-PV value",
          "[values]") {
  TcpPlant plant;
  plant.settle();
  const auto [spoil, mend] =
      GENERATE(std::pair("status 1", "status 0"), std::pair("pv nan", "pv auto"),
               std::pair("pv inf", "pv auto"), std::pair("pv 42", "pv auto"));
  INFO(spoil);
  plant.rig.device.command(spoil);
  CHECK(plant.output_at(kBadPv));
  CHECK(plant.daemon.is("FIC-101", "fault", "bad PV"));
  plant.rig.device.command(mend);
  plant.recovers();
}

TEST_CASE("fault, device restart: its watchdog is set again before the first command") {
  TcpPlant plant;
  plant.settle();
  plant.rig.device.command("restart 1.0");
  CHECK(eventually([&] { return plant.rig.device.state("watchdog_register") == "10"; }));
  plant.recovers();
}

TEST_CASE(
    "fault, replies late, truncated, garbage, of another unit, with another number, exceptions",
    "[values]") {
  TcpPlant plant;
  plant.settle();
  const std::string spoil = GENERATE(as<std::string>(), "late 1000", "truncate", "garbage",
                                     "wrong_unit", "wrong_number", "exception 4");
  INFO(spoil);
  const double before = plant.co();
  plant.rig.proxy.command(spoil);
  REQUIRE(eventually([&] { return !plant.daemon.is("FIC-101", "fault", "none"); }));
  // The loop holds the output while commands still arrive, or the device's watchdog sets its value.
  const bool ended = eventually([&] {
    const double now = plant.co();
    return plant.rig.device.state("watchdog") == "tripped" ? std::abs(now - kDeviceFailSafe) < 0.01
                                                           : std::abs(now - before) < 0.3;
  });
  CHECK(ended);
  plant.rig.proxy.command("ok");
  plant.recovers();
}

TEST_CASE(
    "fault, cable pulled with the link closed: the device's watchdog acts, then bumpless return") {
  TcpPlant plant;
  plant.settle();
  plant.rig.proxy.command("down");
  CHECK(plant.output_at(kDeviceFailSafe));
  CHECK_FALSE(plant.daemon.is("FIC-101", "fault", "none"));
  plant.rig.proxy.command("up");
  plant.recovers();
}

TEST_CASE(
    "fault, cable pulled with the link silent: the device's watchdog acts, then bumpless return") {
  TcpPlant plant;
  plant.settle();
  plant.rig.device.freeze();  // the peer takes bytes but never answers
  CHECK(eventually([&] { return !plant.daemon.is("FIC-101", "fault", "none"); }));
  plant.rig.device.thaw();
  plant.recovers();

  plant.rig.proxy.command("silent");  // requests arrive, replies are lost
  CHECK(plant.output_at(kDeviceFailSafe));
  plant.rig.proxy.command("ok");
  plant.recovers();
}

// The delays are seconds of real time, because hardware runs at real speed.
TEST_CASE(
    "fault, device lost for longer: process alarms are raised, acknowledged, and clear once it is "
    "back") {
  std::string manual = plant_loop("field", 1.0);
  manual.replace(manual.find("recovery: previous_mode"), 23, "recovery: manual");
  manual += "alarms:\n";
  for (const char* alarm : {"bad_pv", "output_lost", "not_normal_mode"}) {
    manual += fmt::format("  {}: {{off_delay: 10}}\n", alarm);
  }
  TcpPlant plant(manual);
  plant.settle();
  const auto state = [&](const char* alarm) {
    return plant.daemon.loop("FIC-101").at("alarms").at(alarm).at("state").get<std::string>();
  };
  const auto becomes = [&](const char* alarm, const std::string& wanted) {
    // Alarms behind an outage stay suppressed for two minutes after it.
    return eventually(
        [&] {
          std::this_thread::sleep_for(std::chrono::milliseconds(200));
          return state(alarm) == wanted;
        },
        std::chrono::seconds(180));
  };
  const auto alarms = [&](const std::string& arguments) {
    return run(LOOPWARDEN_CLI " alarms " + arguments + " --socket " +
               (plant.daemon.folder() / "control.sock").string() + " 2>&1");
  };
  const std::vector<const char*> lost{"bad_pv", "output_lost"};
  const std::vector<const char*> follow{"not_normal_mode", "output_unknown"};
  for (const char* alarm : lost) CHECK(state(alarm) == "normal");

  // One alarm of the box names the lost device. Those of the loop are its consequences.
  plant.rig.proxy.command("down");
  CHECK(eventually(
      [&] {
        std::this_thread::sleep_for(std::chrono::milliseconds(200));
        return alarms("").text.find("connection_lost critical") != std::string::npos;
      },
      std::chrono::seconds(60)));
  for (const char* alarm : lost) CHECK(becomes(alarm, "suppressed"));
  for (const char* alarm : follow) CHECK(becomes(alarm, "suppressed"));
  const std::string told = alarms("explain FIC-101 output_lost").text;
  CHECK_THAT(told, Catch::Contains("Commands don't reach the valve"));
  CHECK_THAT(told, Catch::Contains("consequence of connection_lost"));
  CHECK_THAT(told, !Catch::Contains("evidence"));
  CHECK(alarms("ack box connection_lost").exit_code == 0);

  plant.rig.proxy.command("up");
  for (const char* alarm : lost) CHECK(becomes(alarm, "normal"));
  CHECK(plant.daemon.is("FIC-101", "mode", "MAN"));
  CHECK(becomes("not_normal_mode", "unacknowledged"));
  plant.daemon.client().set({.loop = "FIC-101", .mode = "auto"});
  CHECK(becomes("not_normal_mode", "returned_unacknowledged"));
  const std::string journal = alarms("journal FIC-101").text;
  CHECK_THAT(journal,
             Catch::Contains("bad_pv suppressed -> suppressed consequence of connection_lost"));
  // Its delay starts when PV is back, and ends when the others clear.
  CHECK_THAT(journal, Catch::Contains("not_normal_mode suppressed -> unacknowledged") ||
                          Catch::Contains("not_normal_mode normal -> unacknowledged"));
  CHECK_THAT(journal, !Catch::Contains("evidence"));
}

TEST_CASE("fault, SIGTERM: the output ends at the stop action and the daemon with 0", "[process]") {
  TcpPlant plant;
  plant.settle();
  plant.daemon.signal(SIGTERM);
  CHECK(plant.daemon.wait_for_end() == 0);
  // If this test is held up, the device's watchdog may have acted since.
  CHECK(plant.rig.device.state_number("written") == Approx(kStop));
}

TEST_CASE(
    "fault, SIGTERM while the device is silent: the daemon ends and reports what it could not do",
    "[process]") {
  TcpPlant plant;
  plant.settle();
  plant.rig.proxy.command("down");
  REQUIRE(eventually([&] { return !plant.daemon.is("FIC-101", "fault", "none"); }));
  plant.daemon.signal(SIGTERM);
  CHECK(plant.daemon.wait_for_end() == 0);
  CHECK(plant.daemon.log().find("output NOT at its stop value") != std::string::npos);
  CHECK(plant.output_at(kDeviceFailSafe));
}

TEST_CASE(
    "fault, kill -9: the device's watchdog acts; --safe then sends the output to the stop action",
    "[process]") {
  TcpPlant plant;
  plant.settle();
  plant.daemon.signal(SIGKILL);
  CHECK(plant.daemon.wait_for_end() == -SIGKILL);
  CHECK(plant.output_at(kDeviceFailSafe));
  CHECK(plant.daemon.run({"--config", plant.daemon.config().string(), "--safe"}) == 0);
  CHECK(plant.rig.device.state_number("written") == Approx(kStop));
  plant.rig.proxy.command("down");
  CHECK(plant.daemon.run({"--config", plant.daemon.config().string(), "--safe"}) == 74);
}

TEST_CASE("fault, restart after kill -9: the loop takes over at the valve's position",
          "[process]") {
  TcpPlant plant;
  plant.settle();
  plant.daemon.signal(SIGKILL);
  plant.daemon.wait_for_end();
  CHECK(plant.output_at(kDeviceFailSafe));
  plant.daemon.start();
  plant.recovers();
}

TEST_CASE("fault, SIGSTOP and SIGCONT: the device's watchdog acts, then bumpless return",
          "[process]") {
  TcpPlant plant;
  plant.settle();
  plant.daemon.signal(SIGSTOP);
  CHECK(plant.output_at(kDeviceFailSafe));
  plant.daemon.signal(SIGCONT);
  plant.recovers();
}

TEST_CASE(
    "fault, device absent at start: the daemon runs, and takes the loop over when it appears") {
  TcpPlant plant;
  plant.rig.proxy.command("down");
  plant.daemon.start();
  CHECK(eventually([&] { return plant.daemon.is("FIC-101", "fault", "starting"); }));
  CHECK(plant.co() == Approx(3.0));
  plant.rig.proxy.command("up");
  plant.recovers();
}

// The loop without a read-back, with its first output left to the operator.
std::string untold_loop_file() {
  std::string text = plant_loop("field", 1.0);
  const auto replace = [&](const std::string& from, const std::string& to) {
    text.replace(text.find(from), from.size(), to);
  };
  replace("    read_back: {table: input, address: 20, type: f32}\n", "");
  replace("mode: automatic", "mode: manual");
  return text;
}

TEST_CASE("fault, output unknown: the daemon doesn't write before the operator's first output",
          "[process]") {
  TcpRig rig(kDeviceArguments);
  DaemonProcess daemon("links:\n" + tcp_link_yaml("field", rig.proxy.ready("port")),
                       {{"loops.d/FIC-101.yaml", untold_loop_file()}});
  const auto waits_and_says_so = [&] {
    REQUIRE(eventually([&] { return daemon.is("FIC-101", "fault", "output unknown"); }));
    const auto polls = [&] {
      return daemon.loop("FIC-101").at("io").at("transactions").get<int>();
    };
    const int before = polls();
    REQUIRE(eventually([&] { return polls() > before + 40; }));
    const nlohmann::json loop = daemon.loop("FIC-101");
    INFO(loop.dump(1));
    CHECK(loop.at("co").is_null());
    CHECK(loop.at("mode") == "FALLBACK");
    CHECK(loop.at("requested_mode") == "MAN");
    CHECK(loop.at("ne107") == "function_check");
    CHECK(loop.at("io").at("writes") == 0);
    const protocol::Trend trend = daemon.trend("FIC-101");
    CHECK(trend.co.size() > 20);
    CHECK(std::all_of(trend.co.begin(), trend.co.end(), [](double co) { return std::isnan(co); }));
    CHECK_THROWS_WITH(daemon.client().set({.loop = "FIC-101", .mode = "auto"}),
                      Catch::Contains("output position unknown"));
  };
  daemon.start();
  waits_and_says_so();
  CHECK(rig.device.state("writes") == "0");
  CHECK(rig.device.state("watchdog_register") == "0");
  CHECK(rig.device.state_number("co") == Approx(3.0));  // its old position
  CHECK(daemon.log().find("fault: output unknown; the output is not written") != std::string::npos);

  daemon.client().set({.loop = "FIC-101", .output = 5.0, .mode = "man"});
  CHECK(eventually([&] { return rig.device.state_number("co") == 5.0; }));
  CHECK(rig.device.state("watchdog_register") == "10");
  CHECK(rig.device.state("unguarded_writes") == "0");
  CHECK(eventually([&] { return daemon.is("FIC-101", "fault", "none"); }));
  CHECK(daemon.loop("FIC-101").at("co") == 5.0);
  CHECK(daemon.is("FIC-101", "mode", "MAN"));

  // Nor after a crash: the device's watchdog has acted, and the next daemon has no information
  // about it.
  daemon.signal(SIGKILL);
  daemon.wait_for_end();
  REQUIRE(eventually([&] { return rig.device.state("watchdog") == "tripped"; }));
  const std::string writes = rig.device.state("writes");
  daemon.start();
  waits_and_says_so();
  CHECK(rig.device.state("writes") == writes);
  CHECK(rig.device.state("watchdog") == "tripped");
  CHECK(rig.device.state_number("co") == Approx(kDeviceFailSafe));
}

TEST_CASE("fault, configuration broken: a reload keeps the loop running; a good one is applied",
          "[process]") {
  TcpPlant plant;
  plant.settle();
  plant.daemon.write_config("loops.d/FIC-101.yaml", "loop: FIC-101\ncontroller: [");
  plant.daemon.signal(SIGHUP);
  CHECK(eventually([&] { return plant.daemon.log().find("reload refused") != std::string::npos; }));
  CHECK(plant.in_automatic());
  std::string changed = plant_loop("field", 1.0);
  changed.replace(changed.find("limits: [0, 9]"), 14, "limits: [0, 4]");
  changed.replace(changed.find("set_point: 5"), 12, "set_point: 4");
  changed.replace(changed.find("stop: 2.0"), 9, "stop: 1.0");
  plant.daemon.write_config("loops.d/FIC-101.yaml", changed);
  plant.daemon.signal(SIGHUP);
  CHECK(eventually([&] { return std::abs(plant.pv() - 4.0) < 0.2; }, kSettling));
  plant.daemon.signal(SIGTERM);
  CHECK(plant.daemon.wait_for_end() == 0);
  // The stop action of the new file, not of the old.
  CHECK(plant.rig.device.state_number("written") == Approx(1.0));
}

TEST_CASE("fault, a dead device never delays another loop") {
  TcpRig alive(kDeviceArguments);
  TcpRig dead(kDeviceArguments);
  // A wait for the dead device would be too long for the other's max_age.
  constexpr double kWaitForDead_s = 6.0;
  constexpr double kMaxAge_s = 3.0;
  DaemonProcess daemon(
      "links:\n" + tcp_link_yaml("one", alive.proxy.ready("port"), 1.0) +
          tcp_link_yaml("two", dead.proxy.ready("port"), kWaitForDead_s),
      {{"loops.d/FIC-101.yaml", plant_loop("one", 5.0, "FIC-101", 0.05, kMaxAge_s)},
       {"loops.d/FIC-102.yaml", plant_loop("two", 15.0, "FIC-102", 0.05, kMaxAge_s)}});
  daemon.start();
  REQUIRE(eventually([&] {
    return daemon.is("FIC-101", "mode", "AUTO") && daemon.is("FIC-102", "mode", "AUTO");
  }));
  dead.proxy.command("silent");
  const auto timeouts = [&] { return daemon.loop("FIC-102")["io"]["timeouts"].get<int>(); };
  REQUIRE(eventually([&] {
    REQUIRE(daemon.is("FIC-101", "fault", "none"));
    return timeouts() >= 2;
  }));
  CHECK_FALSE(daemon.is("FIC-102", "fault", "none"));
  CHECK(eventually(
      [&] { return std::abs(dead.device.state_number("co") - kDeviceFailSafe) < 0.01; }));
}

TEST_CASE("fault, kill -9 with a dead device: --safe reaches the others without waiting for it",
          "[process]") {
  TcpRig dead(kDeviceArguments);
  TcpRig alive(kDeviceArguments);
  DaemonProcess daemon("links:\n" + tcp_link_yaml("one", dead.proxy.ready("port")) +
                           tcp_link_yaml("two", alive.proxy.ready("port")),
                       {{"loops.d/FIC-101.yaml", plant_loop("one", 1.0)},
                        {"loops.d/FIC-102.yaml", plant_loop("two", 1.0, "FIC-102")}});
  dead.proxy.command("silent");
  daemon.start({"--safe"});
  CHECK(eventually([&] { return std::abs(alive.device.state_number("written") - kStop) < 0.01; }));
  CHECK(daemon.running());  // it still tries the dead one
  CHECK(daemon.wait_for_end() == 74);
}

TEST_CASE("fault, files with errors: --safe drives every output that they still describe",
          "[process]") {
  const std::string other =
      with(plant_loop("one", 1.0, "FIC-100"), "command: {address: 0,", "command: {address: 12,");
  struct Case {
    std::string daemon, first, loop;
  };
  for (const Case& files :
       {// A second link to the unit, with other settings.
        Case{"", other, plant_loop("two", 1.0)},
        // An invalid loop file, and a key that doesn't matter to the output.
        Case{"", "loop: [\n", with(plant_loop("one", 1.0), "kp: 0.3494", "kp: x")},
        Case{"", other, plant_loop("one", 1.0) + "monitor: {twin: none.yaml}\n"},
        // Errors elsewhere in loopwardend.yaml.
        Case{"log_level: nothing\n", other, plant_loop("one", 1.0)}}) {
    TcpRig rig(kDeviceArguments);
    const std::string port = rig.proxy.ready("port");
    DaemonProcess daemon(
        files.daemon + "links:\n" + tcp_link_yaml("one", port) + tcp_link_yaml("two", port, 0.5),
        {{"loops.d/FIC-100.yaml", files.first},
         {"loops.d/FIC-101.yaml", files.loop},
         {"loops.d/FIC-102.yaml", "nothing"}});
    CHECK(daemon.run({"--config", daemon.config().string(), "--safe"}) == 74);
    const std::string said = read_file(daemon.folder() / "output");
    INFO(said);
    CHECK(said.find("FIC-101: output at 2 V") != std::string::npos);
    CHECK(said.find("FIC-102: output NOT driven") != std::string::npos);
    CHECK(rig.device.state_number("written") == Approx(kStop));
  }
}

}  // namespace
}  // namespace loopwarden::tests::modbus_faults_test
