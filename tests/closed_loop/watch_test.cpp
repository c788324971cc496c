// SPDX-License-Identifier: Apache-2.0
// The real daemon as an observer of a PLC that controls by itself, and of a feeder: it reads, and
// never writes.
#include <pwd.h>
#include <signal.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "base/local_socket.hpp"
#include "tests/support/daemon_process.hpp"
#include "tests/support/loop_file.hpp"
#include "tests/support/shell.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::tests::watch_test {
namespace {

using nlohmann::json;
using test::eventually;
using test::ForeignProcess;

std::string user() { return ::getpwuid(::getuid())->pw_name; }

std::string daemon_yaml(const std::string& port) {
  return "real_time: {priority: 0, lock_memory: false}\n"
         "feeders: {plant: {user: " +
         user() +
         "}}\n"
         "links: {plc: {transport: tcp, host: 127.0.0.1, port: " +
         port + ", reconnect_min: 0.05, reconnect_max: 0.2}}\n";
}

const std::string kHead = R"(control: elsewhere
sample_time: 0.1
process_variable: {unit: m3/h, range: [0, 40], max_age: 0.5}
output: {unit: "%", range: [-5, 105]}
)";

const std::string kByModbus = "loop: FIC-205\n" + kHead +
                              R"(recording: {enabled: true}
io:
  backend: modbus
  pv: {link: plc, unit: 1, register: {table: input, address: 0, type: f32}}
  co: {link: plc, unit: 1, register: {table: input, address: 2, type: f32}}
  sp: {link: plc, unit: 1, register: {table: holding, address: 4, type: f32}}
  mode: {link: plc, unit: 1, register: {table: input, address: 8, type: u16}, )"
                              R"(automatic: [1, 3], manual: [0]}
)";

const std::string kByFeed = "loop: FIC-206\n" + kHead + R"(recording: {enabled: false}
io:
  backend: feed
  pv: {feed: "plant:FIC206.PV"}
  co: {feed: "plant:FIC206.OP"}
  sp: {feed: "plant:FIC206.SP"}
)";

struct Rig {
  Rig()
      : plc("plc_device.py", {}),
        daemon(daemon_yaml(plc.ready("port")), {{"loops.d/a-205.yaml", kByModbus},
                                                {"loops.d/b-206.yaml", kByFeed},
                                                {"loops.d/z-101.yaml", loop_file("FIC-101")}}) {
    daemon.start();
  }

  json loop(const std::string& tag) {
    base::LocalClient client((daemon.folder() / "status.sock").string());
    return json::parse(
        client.request(json{{"request", "loop"}, {"loop", tag}}.dump(), std::chrono::seconds(10)));
  }
  bool no_valve_alarm(const std::string& tag) {
    const json alarms = loop(tag).at("alarms");
    for (const char* alarm :
         {"stiction", "backlash", "hysteresis", "low_air_supply", "unknown", "model_gap"}) {
      if (alarms.at(alarm).at("active") == true) return false;
    }
    return true;
  }
  ShellOutcome loopwarden(const std::string& arguments) const {
    return run("LOOPWARDEN_SOCKET=" + (daemon.folder() / "control.sock").string() +
               " " LOOPWARDEN_CLI " " + arguments + " 2>&1");
  }
  std::string functions() { return ForeignProcess::field(plc.command("state"), "functions"); }

  ForeignProcess plc;
  DaemonProcess daemon;
};

}  // namespace

TEST_CASE("a loop that a PLC controls is watched only by reading", "[watch]") {
  Rig rig;
  const auto newest = [&] { return rig.loop("FIC-205"); };
  // Each value is read separately: all of them are there.
  REQUIRE(eventually([&] {
    const json now = newest();
    return now.value("fault", "") == "none" && now.at("mode") == "AUTO" && !now.at("sp").is_null();
  }));
  json loop = newest();
  CHECK(loop.at("control") == "elsewhere");
  CHECK(loop.at("pv").get<double>() == Approx(20.0).margin(1.0));
  CHECK(loop.at("co").get<double>() == Approx(50.0).margin(5.0));
  CHECK(loop.at("sp") == 20.0);
  CHECK(loop.at("mode") == "AUTO");
  CHECK(loop.at("fault") == "none");
  CHECK(loop.at("io").at("connected") == true);
  CHECK(eventually([&] { return newest().at("monitor").at("window_state") == "filling"; }));
  CHECK(rig.loop("FIC-101").at("control") == "here");

  SECTION("the loop accepts no command") {
    const ShellOutcome refused = rig.loopwarden("set FIC-205 --sp 10");
    CHECK(refused.exit_code == 65);
    CHECK(refused.text.find("FIC-205 is controlled elsewhere") != std::string::npos);
    CHECK(rig.loopwarden("set FIC-101 --sp 6").exit_code == 0);
    CHECK(newest().at("sp") == 20.0);
  }
  SECTION("windows are judged only in automatic") {
    rig.plc.command("mode 0");
    CHECK(eventually([&] { return newest().at("mode") == "MAN"; }));
    CHECK(eventually([&] { return newest().at("monitor").at("window_state") == "not automatic"; }));
    rig.plc.command("mode 2");
    CHECK(eventually([&] { return newest().at("mode") == "FALLBACK"; }));
    rig.plc.command("mode 3");
    CHECK(eventually([&] { return newest().at("mode") == "AUTO"; }));
    CHECK(eventually([&] { return newest().at("monitor").at("window_state") == "filling"; }));
  }
  SECTION("a lost PLC is reported, and is back without a restart") {
    rig.plc.command("restart 1");
    CHECK(eventually([&] { return newest().at("pv_quality") == "bad"; }));
    CHECK(newest().at("pv").is_null());
    CHECK(eventually([&] { return newest().at("fault") == "none"; }));
    CHECK(rig.no_valve_alarm("FIC-205"));
  }
  SECTION("the end of the daemon moves no output of the PLC") {
    rig.daemon.signal(SIGTERM);
    CHECK(rig.daemon.wait_for_end() == 0);
    const ShellOutcome safe =
        run(std::string(LOOPWARDEN_BIN_DIR) + "/loopwardend --safe --config " +
            rig.daemon.config().string() + " 2>&1");
    CHECK(safe.text.find("FIC-205") == std::string::npos);
  }
  const std::string functions = rig.functions();
  CHECK(functions == "3,4");
}

TEST_CASE("commission, diagnose and gap use the recorder's data of a watched loop", "[watch]") {
  Rig rig;
  const std::string out = (rig.daemon.folder() / "made").string();
  const auto commission = [&](const std::string& arguments) {
    return rig.loopwarden("commission --windows 700 --out " + out + " " + arguments);
  };
  REQUIRE(eventually([&] { return rig.loop("FIC-205").at("recording").at("bytes") > 4096; }));
  ShellOutcome made{-1, {}};
  // The newest samples may not be on the disk yet.
  REQUIRE(eventually([&] {
    made = commission("--loop FIC-205 --last 1h");
    return made.exit_code == 0;
  }));
  INFO(made.text);
  CHECK(made.text.find("not_enough_movement") != std::string::npos);
  std::size_t records = 0;
  for (const auto& entry : std::filesystem::directory_iterator(out + "/records")) {
    ++records;
    const std::string text = read_file(entry.path());
    CHECK(text.starts_with("time,pv,sp,co"));
  }
  CHECK(records == 1);
  CHECK(commission("--loop FIC-206 --last 1h").exit_code == 65);  // it is not recorded
  CHECK(commission("--loop FIC-999 --last 1h").exit_code == 64);
  CHECK(commission("--loop FIC-205 --last soon").exit_code == 64);
  CHECK(commission("--last 1h").exit_code == 64);
  CHECK(commission("").exit_code == 64);
  CHECK(commission(out + "/x.csv --last 1h --loop FIC-205").exit_code == 64);

  const TemporaryFolder scratch;
  const auto diagnose = [&](const std::string& arguments) {
    return run("TMPDIR=" + scratch.path().string() +
               " LOOPWARDEN_SOCKET=" + (rig.daemon.folder() / "control.sock").string() +
               " " LOOPWARDEN_CLI " diagnose " + arguments + " 2>/dev/null");
  };
  const ShellOutcome diagnosed = diagnose("--loop FIC-205 --last 1h --json");
  REQUIRE(diagnosed.exit_code == 0);
  const json answer = json::parse(diagnosed.text);
  CHECK(answer.at("verdict") == "not_enough_data");  // some seconds
  CHECK(answer.at("co_range") == json({-5.0, 105.0}));
  CHECK(std::filesystem::is_empty(scratch.path()));
  CHECK(json::parse(diagnose("--loop FIC-205 --last 1h --json --co-range 0 50").text)
            .at("co_range") == json({0.0, 50.0}));
  CHECK(diagnose("--loop FIC-206 --last 1h").exit_code == 65);
  CHECK(std::filesystem::is_empty(scratch.path()));
  CHECK(diagnose("--loop FIC-205").exit_code == 64);
  CHECK(diagnose("--loop FIC-205 --last 1h --neighbours x.csv").exit_code == 64);

  const std::string found = (rig.daemon.folder() / "found").string();
  const ShellOutcome gap = rig.loopwarden("gap --loop FIC-205 --last 1h --out " + found);
  CHECK(gap.exit_code == 65);  // no model can be identified from a loop at rest
  CHECK(gap.text.find(found + "/records/FIC-205_") != std::string::npos);
  CHECK(std::distance(std::filesystem::directory_iterator(found + "/records"), {}) == 1);
  CHECK(rig.loopwarden("gap --out " + found).exit_code == 64);
}

TEST_CASE("a fed loop holds while its feeder lives, and is stale when it has died", "[watch]") {
  Rig rig;
  const std::string path = (rig.daemon.folder() / "feed.sock").string();
  const auto newest = [&] { return rig.loop("FIC-206"); };
  REQUIRE(eventually([&] { return newest().value("pv_reason", "") == "never received"; }));
  {
    base::LocalClient feeder(path);
    const auto feed = [&](const json& values) {
      return json::parse(
          feeder.request(json{{"values", values}, {"id", 1}}.dump(), std::chrono::seconds(10)));
    };
    const json told = feed({{{"name", "FIC206.PV"}, {"value", 12.5}, {"quality", "good"}},
                            {{"name", "FIC206.OP"}, {"value", 33.0}},
                            {{"name", "FIC206.SP"}, {"value", 13.0}},
                            {{"name", "TT-9"}, {"value", 1.0}}});
    CHECK(told.at("taken") == 3);
    CHECK(eventually([&] { return newest().at("pv") == 12.5; }));
    json loop = newest();
    CHECK(loop.at("co") == 33.0);
    CHECK(loop.at("sp") == 13.0);
    CHECK(loop.at("mode") == "AUTO");  // no mode is wired
    // Signs of life without new values.
    CHECK(eventually([&] {
      feed(json::array());
      return newest().at("pv_reason") == "held";
    }));
    CHECK(newest().at("pv_quality") == "good");
    const json feeders =
        json::parse(base::LocalClient((rig.daemon.folder() / "status.sock").string())
                        .request(R"({"request":"status"})", std::chrono::seconds(10)))
            .at("daemon")
            .at("feeders");
    REQUIRE(feeders.size() == 1);
    CHECK(feeders[0].at("name") == "plant");
    CHECK(feeders[0].at("connected") == true);
    CHECK(feeders[0].at("unknown_names") == 1);
  }
  CHECK(eventually([&] { return newest().at("pv_reason") == "stale"; }));
  CHECK(newest().at("pv").is_null());
  CHECK(newest().at("fault") == "bad PV");
  CHECK(rig.no_valve_alarm("FIC-206"));
  base::LocalClient again(path);
  again.request(R"({"values":[{"name":"FIC206.PV","value":14.0}],"id":2})",
                std::chrono::seconds(10));
  CHECK(eventually([&] { return newest().at("pv") == 14.0; }));
}

}  // namespace loopwarden::tests::watch_test
