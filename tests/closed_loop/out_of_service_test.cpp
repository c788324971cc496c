// SPDX-License-Identifier: Apache-2.0
// Files that a start can't work with, in the real daemon: they are not loaded, and one loop's
// errors stop no other loop.
#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/support/daemon_process.hpp"
#include "tests/support/loop_file.hpp"
#include "tests/support/shell.hpp"
#include "tests/support/text.hpp"

namespace loopwarden::tests::out_of_service_test {
namespace {

using nlohmann::json;
using test::eventually;

const std::string kDaemon = "accelerate: 20\nreal_time: {priority: 0, lock_memory: false}\n";
const std::string kTwin =
    "sample_time: 0.1\ncontroller: {kp: 0.4, ki: 0.15, output: [0, 10]}\n"
    "process: {gain: 1.0, time_constant: 1.5, dead_time: 0.6}\ntransmitter: {range: [0, 10]}\n";
std::string bad_twin() { return with(kTwin, "sample_time: 0.1", "sample_time: 0.2"); }

std::string loop_of(const std::string& tag, const std::string& more = "") {
  return loop_file(tag) + more;
}
const std::string kNamesTwin = "monitor: {twin: ../twin.yaml}\n";

struct Plant {
  explicit Plant(const std::string& second)
      : daemon(kDaemon, {{"loops.d/1.yaml", loop_of("FIC-101")},
                         {"loops.d/2.yaml", second},
                         {"loops.d/3.yaml", loop_of("FIC-103")},
                         {"twin.yaml", bad_twin()}}) {}
  ShellOutcome command(const std::string& words) const {
    return run(std::string(LOOPWARDEN_CLI) + " " + words + " 2>&1");
  }
  std::string socket() const { return " --socket " + (daemon.folder() / "control.sock").string(); }
  bool runs(const char* loop) {
    return eventually([&] { return daemon.is(loop, "mode", "AUTO"); });
  }
  std::vector<std::string> tags() {
    std::vector<std::string> all;
    const json status = daemon.status();
    for (const json& loop : status.at("loops")) all.push_back(loop.at("name"));
    return all;
  }
  DaemonProcess daemon;
};

}  // namespace

TEST_CASE("errors that a start would refuse are refused by check, reload and dry run alike",
          "[out_of_service]") {
  Plant plant(loop_of("FIC-102"));
  plant.daemon.start();
  CHECK(plant.command("check " + plant.daemon.config().string()).exit_code == 0);
  plant.daemon.write_config("loops.d/2.yaml", loop_of("FIC-102", kNamesTwin));
  const std::string config = plant.daemon.config().string();
  for (const std::string& words :
       {"check " + config, "check " + config + "/loops.d/2.yaml", "reload" + plant.socket(),
        "reload --dry-run" + plant.socket()}) {
    const ShellOutcome said = plant.command(words);
    INFO(words << ": " << said.text);
    CHECK(said.exit_code == 78);
    CHECK(said.text.find("2.yaml:14:17: error: monitor.twin: ") != std::string::npos);
    CHECK(said.text.find("sample_time 0.2 s, this loop 0.1 s") != std::string::npos);
  }
  CHECK(plant.daemon.run({"--config", config, "--check"}) == 78);
  // It continues unchanged.
  CHECK(plant.daemon.loop("FIC-102").at("out_of_service").is_null());
  plant.daemon.write_config("twin.yaml", kTwin);
  CHECK(plant.command("check " + config).exit_code == 0);
  CHECK(plant.command("reload --dry-run" + plant.socket()).exit_code == 75);
}

TEST_CASE("a loop whose files are bad at the start stays out of service, and the others run",
          "[out_of_service]") {
  for (const std::string& bad :
       {loop_of("FIC-102", kNamesTwin), loop_of("FIC-102", "monitor: {specialists: ../none}\n"),
        with(loop_of("FIC-102"), "kp: 0.35", "kp: x"), std::string("loop: FIC-102\na: [\n")}) {
    Plant plant(bad);
    INFO(bad);
    plant.daemon.start();
    CHECK(plant.runs("FIC-101"));
    CHECK(plant.runs("FIC-103"));
    CHECK(plant.tags() == std::vector<std::string>{"FIC-101", "FIC-102", "FIC-103"});
    const json loop = plant.daemon.loop("FIC-102");
    CHECK(loop.at("out_of_service").get<std::string>().find("2.yaml:") != std::string::npos);
    CHECK(loop.at("pv_reason") == "out of service");
    CHECK(plant.daemon.status().at("daemon").at("configuration").at("files_in_force") == false);
    // An alarm with its reason, and a line in the journal.
    CHECK(eventually([&] {
      return plant.daemon.loop("FIC-102").at("alarms").at("bad_pv").at("active") == true;
    }));
    CHECK(
        plant.daemon.explain("FIC-102", "bad_pv").at("cause").get<std::string>().find("2.yaml:") !=
        std::string::npos);
    bool written = false;
    const json journal = plant.daemon.journal(50, "FIC-102");
    for (const json& line : journal) {
      written = written || line.at("result") == "out of service";
    }
    CHECK(written);
    // It accepts no command.
    for (const char* order : {"FIC-102 --mode auto", "FIC-102 --output 3", "FIC-102 --sp 4"}) {
      const ShellOutcome said = plant.command(std::string("set ") + order + plant.socket());
      INFO(said.text);
      CHECK(said.exit_code != 0);
      CHECK(said.text.find("out of service") != std::string::npos);
    }
    // Corrected files need a restart.
    plant.daemon.write_config("loops.d/2.yaml", loop_of("FIC-102"));
    const ShellOutcome reloaded = plant.command("reload" + plant.socket());
    INFO(reloaded.text);
    CHECK(reloaded.exit_code == 75);
    CHECK(reloaded.text.find("FIC-102: the loop is out of service since the start") !=
          std::string::npos);
    plant.daemon.signal(SIGTERM);
    CHECK(plant.daemon.wait_for_end() == 0);
    plant.daemon.start();
    CHECK(plant.runs("FIC-102"));
  }
}

TEST_CASE(
    "without a valid loop, or with other errors in loopwardend.yaml, the daemon doesn't start",
    "[out_of_service]") {
  DaemonProcess none(kDaemon, {{"loops.d/1.yaml", loop_of("FIC-101", kNamesTwin)}});
  CHECK(none.run({"--config", none.config().string()}) == 78);
  DaemonProcess daemon(kDaemon + "log_level: nothing\n", {{"loops.d/1.yaml", loop_of("FIC-101")}});
  CHECK(daemon.run({"--config", daemon.config().string()}) == 78);
  // Its output is driven nevertheless.
  CHECK(daemon.run({"--config", daemon.config().string(), "--safe"}) == 0);
  CHECK(read_file(daemon.folder() / "output").find("FIC-101: output at 0 V") != std::string::npos);
}

}  // namespace loopwarden::tests::out_of_service_test
