// SPDX-License-Identifier: Apache-2.0
// After a reload, status, registers and log of the real daemon show the configuration in force.
#include <catch2/catch.hpp>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "base/local_socket.hpp"
#include "tests/support/daemon_process.hpp"
#include "tests/support/free_port.hpp"
#include "tests/support/loop_file.hpp"
#include "tests/support/shell.hpp"

namespace loopwarden::tests::reload_test {
namespace {

using nlohmann::json;
using test::eventually;

std::string output_of(const std::string& command) { return run(command + " 2>&1").text; }

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  REQUIRE(at != std::string::npos);
  return text.replace(at, from.size(), to);
}

const std::string kModel = R"(sample_time: 0.1
controller: {kp: 0.35, ki: 0.04, output: [0, 10]}
process: {gain: 1.2264, time_constant: 1.7, dead_time: 2.6}
transmitter: {range: [0, 10]}
)";

struct Plant {
  Plant()
      : port(free_port()), daemon(daemon_text(), {{"loops.d/1.yaml", loop}, {"m.yaml", kModel}}) {
    daemon.start();
    REQUIRE(eventually([&] { return daemon.is("FIC-101", "mode", "AUTO"); }));
  }

  std::string daemon_text(const std::string& more = {}) const {
    return "real_time: {priority: 0, lock_memory: false}\nmodbus_server: {port: " +
           std::to_string(port) + ", request_rate: 1000}\n" + more;
  }
  void write_daemon(const std::string& more) {
    daemon.write_config("loopwardend.yaml", "runtime_directory: " + daemon.folder().string() +
                                                "\nstate_directory: " + daemon.folder().string() +
                                                "\n" + daemon_text(more));
  }
  json status() { return daemon.status().at("daemon"); }
  json configuration() { return status().at("configuration"); }
  std::uint32_t shown_hash() { return status().at("config_hash").get<std::uint32_t>(); }
  // Reads a register with a foreign master.
  std::int64_t input_register(int address, const std::string& type) const {
    const std::string text =
        output_of("mbpoll -q -1 -0 -B -m tcp -p " + std::to_string(port) + " -t 3" + type +
                  " -c 1 -r " + std::to_string(address) + " 127.0.0.1");
    const std::size_t colon = text.find("]:");
    INFO(text);
    REQUIRE(colon != std::string::npos);
    return std::stoll(text.substr(colon + 2));
  }
  std::uint32_t hash_register() const {
    return static_cast<std::uint32_t>(input_register(18, ":int"));
  }
  // Returns the CRC-32 of the present files, calculated by a foreign program.
  std::uint32_t hash_of_files() {
    const std::string folder = daemon.config().string();
    return static_cast<std::uint32_t>(
        std::stoul(output_of("cat " + folder + "/loopwardend.yaml " + folder +
                             "/loops.d/*.yaml | python3 -c 'import sys, zlib; "
                             "print(zlib.crc32(sys.stdin.buffer.read()))'")));
  }
  // Returns the log from SIGHUP on until the reload is done.
  std::string reload() {
    const std::size_t before = daemon.log().size();
    daemon.signal(SIGHUP);
    std::string said;
    REQUIRE(eventually([&] {
      said = daemon.log().substr(before);
      return said.find("reload: done") != std::string::npos ||
             said.find("reload refused") != std::string::npos;
    }));
    REQUIRE(eventually([&] {
      return !configuration().at("refused").get<std::string>().empty() ||
             configuration().at("files_hash") == hash_of_files();
    }));
    return said;
  }
  ShellOutcome command(const std::string& arguments) const {
    return tests::run(std::string(LOOPWARDEN_CLI) + " " + arguments + " --socket " +
                      daemon.folder().string() + "/control.sock 2>&1");
  }
  std::set<std::string> waiting(const char* list = "waiting_for_restart") {
    std::set<std::string> keys;
    const json configuration_now = configuration();
    for (const json& w : configuration_now.at(list)) keys.insert(w.at("key"));
    return keys;
  }

  const std::string loop = loop_file("FIC-101", "../m.yaml");
  int port;
  DaemonProcess daemon;
};

}  // namespace

TEST_CASE(
    "after a good reload status and register show the hash of the new files, after a bad one the "
    "old hash",
    "[reload]") {
  Plant plant;
  const std::uint32_t first = plant.hash_of_files();
  CHECK(plant.shown_hash() == first);
  CHECK(plant.hash_register() == first);
  CHECK(plant.configuration().at("files_in_force") == true);

  plant.daemon.write_config("loops.d/1.yaml", replaced(plant.loop, "kp: 0.35", "kp: 0.3"));
  plant.reload();
  const std::uint32_t second = plant.hash_of_files();
  CHECK(second != first);
  CHECK(plant.shown_hash() == second);
  CHECK(plant.hash_register() == second);
  CHECK(plant.waiting().empty());

  plant.daemon.write_config("loops.d/1.yaml", replaced(plant.loop, "kp: 0.35", "kp: -1"));
  plant.reload();
  CHECK(plant.shown_hash() == second);
  CHECK(plant.configuration().at("files_in_force") == false);
  CHECK_THAT(plant.configuration().at("refused").get<std::string>(),
             Catch::Contains("loops.d/1.yaml:") && Catch::Contains("kp"));

  plant.daemon.write_config("loops.d/1.yaml", plant.loop);
  plant.reload();
  CHECK(plant.shown_hash() == first);
  CHECK(plant.configuration().at("refused") == "");
}

TEST_CASE(
    "keys that a reload does not apply are named in log and status, and the hash is that of no set "
    "of files",
    "[reload]") {
  Plant plant;
  const std::uint32_t first = plant.hash_of_files();
  plant.write_daemon("alarms: {severe: 20}\nlog_level: debug\n");
  plant.daemon.write_config("loops.d/1.yaml", replaced(replaced(plant.loop, "kp: 0.35", "kp: 0.3"),
                                                       "{enabled: false}", "{enabled: true}") +
                                                  "monitor: {overlap: 0.25}\n");
  plant.reload();
  CHECK(plant.waiting() ==
        std::set<std::string>{"alarms.severe", "recording.enabled", "monitor.overlap"});
  const std::string log = plant.daemon.log();
  for (const char* line : {"loopwardend.yaml: waits for a restart: alarms.severe 10 -> 20",
                           "loopwardend.yaml: applied: log_level info -> debug",
                           "FIC-101: applied: controller.kp 0.35 -> 0.3",
                           "FIC-101: waits for a restart: recording.enabled false -> true, "
                           "monitor.overlap 0.5 -> 0.25"}) {
    CHECK_THAT(log, Catch::Contains(line));
  }
  const std::uint32_t mixed = plant.shown_hash();
  CHECK(mixed != first);
  CHECK(mixed != plant.hash_of_files());
  CHECK(plant.hash_register() == mixed);
  CHECK(plant.configuration().at("files_in_force") == false);
  plant.reload();
  CHECK(plant.shown_hash() == mixed);  // the same files, the same hash

  plant.write_daemon("log_level: debug\n");
  plant.daemon.write_config("loops.d/1.yaml", replaced(plant.loop, "kp: 0.35", "kp: 0.3"));
  plant.reload();
  CHECK(plant.waiting().empty());
  CHECK(plant.shown_hash() == plant.hash_of_files());
}

TEST_CASE("a loop whose units and ranges change keeps everything, and the others take theirs",
          "[reload]") {
  Plant plant;
  plant.daemon.write_config("loops.d/2.yaml", loop_file("FIC-102", "../m.yaml"));
  plant.daemon.signal(SIGTERM);
  REQUIRE(plant.daemon.wait_for_end() == 0);
  plant.daemon.start();
  REQUIRE(eventually([&] { return plant.daemon.is("FIC-102", "mode", "AUTO"); }));
  REQUIRE(plant.command("set FIC-101 --mode man --output 4").exit_code == 0);
  REQUIRE(eventually([&] { return plant.daemon.loop("FIC-101").at("co") == 4.0; }));

  // From V to %, with all consequences in the file: ranges, gain and safe actions ten times as
  // large.
  std::string percent =
      replaced(plant.loop, "unit: V, range: [0, 10]", "unit: \"%\", range: [0, 100]");
  percent = replaced(replaced(percent, "kp: 0.35", "kp: 3.5"), "stop: 0", "stop: 40");
  plant.daemon.write_config("m.yaml", replaced(kModel, "output: [0, 10]", "output: [0, 100]"));
  plant.daemon.write_config("loops.d/1.yaml", percent);
  plant.daemon.write_config("loops.d/2.yaml", replaced(loop_file("FIC-102", LOOPWARDEN_SOURCE_DIR
                                                                 "/examples/models/plant1.yaml"),
                                                       "kp: 0.35", "kp: 0.3"));
  // The model of the second loop is another one, too. No part of it is applied either.
  ShellOutcome told = plant.command("reload");
  CHECK(told.exit_code == 75);
  CHECK_THAT(told.text, Catch::Contains("FIC-101: all changes wait for a restart") &&
                            Catch::Contains("controller.output.unit V -> %") &&
                            Catch::Contains("also waiting: controller.kp 0.35 -> 3.5") &&
                            Catch::Contains("FIC-102: all changes wait for a restart") &&
                            Catch::Contains("not everything in the files is in force"));
  // Only the second one's tuning is applied, whatever the first one waits for.
  plant.daemon.write_config("loops.d/2.yaml",
                            replaced(loop_file("FIC-102", "../m2.yaml"), "kp: 0.35", "kp: 0.3"));
  plant.daemon.write_config("m2.yaml", kModel);
  told = plant.command("reload");
  CHECK(told.exit_code == 75);
  CHECK_THAT(told.text, Catch::Contains("FIC-102: applied: controller.kp 0.35 -> 0.3"));
  const json loop = plant.daemon.loop("FIC-101");
  CHECK(loop.at("co") == 4.0);
  CHECK(loop.at("co_range") == json({0.0, 10.0}));
  CHECK(loop.at("co_unit") == "V");
  CHECK(plant.waiting().contains("controller.output.unit"));
  CHECK_FALSE(plant.configuration().at("files_in_force").get<bool>());
  CHECK_THAT(plant.command("top --once").text, Catch::Contains("configuration waits"));
  // Commands are judged by the settings in force: 30 is no output of 0 to 10 V.
  CHECK(plant.command("set FIC-101 --output 30").exit_code == 65);

  // After a return to the old files no key waits.
  plant.daemon.write_config("m.yaml", kModel);
  plant.daemon.write_config("loops.d/1.yaml", plant.loop);
  told = plant.command("reload");
  CHECK(told.exit_code == 0);
  CHECK(plant.waiting().empty());
  CHECK(plant.shown_hash() == plant.hash_of_files());
}

TEST_CASE("the command prints the text that SIGHUP logs, and a dry run changes no setting",
          "[reload]") {
  Plant plant;
  const std::uint32_t first = plant.shown_hash();
  plant.daemon.write_config("loops.d/1.yaml", replaced(plant.loop, "kp: 0.35", "kp: 0.3"));
  plant.write_daemon("page: {alarms: true}\n");
  const ShellOutcome dry = plant.command("reload --dry-run");
  CHECK(dry.exit_code == 0);
  CHECK_THAT(dry.text, Catch::Contains("FIC-101: applied: controller.kp 0.35 -> 0.3") &&
                           Catch::Contains("would be in force"));
  CHECK(plant.shown_hash() == first);
  CHECK_FALSE(std::filesystem::exists(plant.daemon.folder().string() + "/page.sock"));

  const std::string logged = plant.reload();
  CHECK_THAT(logged, Catch::Contains("reload: FIC-101: applied: controller.kp 0.35 -> 0.3") &&
                         Catch::Contains("page {alarms: false, control: false} -> "));
  CHECK(plant.shown_hash() == plant.hash_of_files());
  const ShellOutcome again = plant.command("reload");
  CHECK(again.exit_code == 0);
  CHECK(again.text == "everything in the files is in force\n");

  plant.daemon.write_config(
      "loops.d/1.yaml", replaced(plant.loop, "loop: FIC-101", "loop: FIC-101\ndescription: feed"));
  const ShellOutcome waits = plant.command("reload --json");
  CHECK(waits.exit_code == 75);
  const json result = json::parse(waits.text);
  CHECK(result.at("outcome") == "waits");
  CHECK(result.at("plan").at("loops")[0].at("applied")[0].at("key") == "controller.kp");
  CHECK(result.at("plan").at("loops")[0].at("waiting_for_restart")[0].at("key") == "description");
  CHECK(result.at("on_disk") == true);
  const std::string journal = plant.command("alarms journal").text;
  CHECK_THAT(journal, Catch::Contains("SIGHUP") && Catch::Contains("reload") &&
                          Catch::Contains("done; 1 key waits"));
}

TEST_CASE("files with errors, or half written, change no setting and end the command with 78",
          "[reload]") {
  Plant plant;
  const std::uint32_t first = plant.shown_hash();
  const bool half = GENERATE(true, false);
  plant.write_daemon("log_level: debug\n");
  plant.daemon.write_config("loops.d/1.yaml", half ? plant.loop.substr(0, plant.loop.size() / 2)
                                                   : replaced(plant.loop, "kp: 0.35", "kp: -1"));
  for (const char* line : {"reload --dry-run", "reload"}) {
    const ShellOutcome told = plant.command(line);
    INFO(told.text);
    CHECK(told.exit_code == 78);
    CHECK_THAT(told.text, Catch::Contains("loops.d/1.yaml:") && Catch::Contains(": error: ") &&
                              Catch::Contains("refused"));
  }
  CHECK(plant.shown_hash() == first);
  CHECK_FALSE(plant.configuration().at("refused").get<std::string>().empty());
  CHECK(plant.daemon.is("FIC-101", "mode", "AUTO"));
  CHECK_THAT(plant.command("alarms journal").text, Catch::Contains("refused: "));
}

TEST_CASE("limits that exclude CO are applied once CO is inside", "[reload]") {
  Plant plant;
  const auto co = [&] { return plant.daemon.loop("FIC-101").at("co").get<double>(); };
  REQUIRE(plant.command("set FIC-101 --mode man --output 8").exit_code == 0);
  REQUIRE(eventually([&] { return co() == 8.0; }));
  plant.daemon.write_config("loops.d/1.yaml",
                            replaced(replaced(plant.loop, "unit: V, range: [0, 10]",
                                              "unit: V, range: [0, 10], limits: [0, 6]"),
                                     "kp: 0.35", "kp: 0.3"));
  const ShellOutcome dry = plant.command("reload --dry-run");
  CHECK(dry.exit_code == 75);
  const ShellOutcome told = plant.command("reload");
  CHECK(told.exit_code == 75);
  CHECK_THAT(told.text,
             Catch::Contains("FIC-101: waits until CO, at 8 V, is inside the new limits [0, 6] V"));
  CHECK(plant.waiting("waiting_for_output") ==
        std::set<std::string>{"controller.kp", "controller.output.limits"});
  CHECK(co() == 8.0);
  CHECK(plant.command("set FIC-101 --output 8.5").exit_code == 0);  // by the limits in force
  const std::uint32_t mixed = plant.shown_hash();
  CHECK(mixed != plant.hash_of_files());

  CHECK(plant.command("set FIC-101 --output 5").exit_code == 0);
  CHECK(eventually([&] { return plant.shown_hash() == plant.hash_of_files(); }));
  CHECK(plant.waiting("waiting_for_output").empty());
  CHECK(co() == 5.0);
  CHECK(plant.command("set FIC-101 --output 8").exit_code == 65);
  CHECK_THAT(plant.daemon.log(), Catch::Contains("reload: FIC-101: in force now"));
}

TEST_CASE("reload is a command: the sockets of readers and of the page don't offer it",
          "[reload]") {
  Plant plant;
  for (const char* request : {"reload", "reload_state"}) {
    base::LocalClient status(plant.daemon.folder().string() + "/status.sock");
    const json answer = json::parse(status.request(
        json{{"request", request}, {"dry_run", true}}.dump(), std::chrono::seconds(30)));
    CHECK(answer.at("ok") == false);
    CHECK_THAT(answer.at("error").get<std::string>(), Catch::Contains("on control.sock"));
  }
  plant.write_daemon("page: {alarms: true, control: true}\n");
  REQUIRE(plant.command("reload").exit_code == 0);
  const std::string socket = plant.daemon.folder().string() + "/page.sock";
  REQUIRE(eventually([&] { return std::filesystem::exists(socket); }));
  base::LocalClient page(socket);
  const json answer =
      json::parse(page.request(R"({"request":"reload"})", std::chrono::seconds(30)));
  CHECK(answer.at("ok") == false);
}

TEST_CASE("a reload grants the page its rights and withdraws them, without a restart", "[reload]") {
  Plant plant;
  const std::string socket = plant.daemon.folder().string() + "/page.sock";
  const std::string order =
      R"({"request":"set","loop":"FIC-101","set_point":6,"user":"anna","address":"10.0.0.5"})";
  const auto told = [&](base::LocalClient& page) {
    return json::parse(page.request(order, std::chrono::seconds(30)));
  };
  CHECK_FALSE(std::filesystem::exists(socket));
  plant.write_daemon("page: {alarms: true}\n");
  plant.reload();
  CHECK(plant.waiting().empty());
  REQUIRE(eventually([&] { return std::filesystem::exists(socket); }));
  base::LocalClient page(socket);
  CHECK_THAT(told(page).at("error").get<std::string>(), Catch::Contains("page: {control: true}"));
  plant.write_daemon("page: {alarms: true, control: true}\n");
  plant.reload();
  CHECK(told(page).at("ok") == true);
  CHECK(eventually([&] {
    return output_of(std::string(LOOPWARDEN_CLI) + " alarms journal --socket " +
                     plant.daemon.folder().string() + "/control.sock")
               .find("anna@10.0.0.5 by page (uid ") != std::string::npos;
  }));
  plant.write_daemon("page: {}\n");
  plant.reload();
  CHECK(eventually([&] { return !std::filesystem::exists(socket); }));
  CHECK(std::filesystem::exists(plant.daemon.folder().string() + "/status.sock"));
}

TEST_CASE("a runtime directory that is missing is made, as the state directory is", "[reload]") {
  DaemonProcess daemon("", {{"loops.d/1.yaml", loop_file("FIC-101")}});
  const std::string folder = daemon.folder().string();
  daemon.write_config("loopwardend.yaml", "runtime_directory: " + folder +
                                              "/run/deep\nstate_directory: " + folder +
                                              "/state/deep\nreal_time: {priority: 0, lock_memory: "
                                              "false}\n");
  daemon.start({});
  CHECK(eventually([&] { return std::filesystem::exists(folder + "/run/deep/control.sock"); }));
  CHECK(eventually([&] { return std::filesystem::exists(folder + "/run/deep/metrics.prom"); }));
  daemon.signal(SIGTERM);
  CHECK(daemon.wait_for_end() == 0);
  // Sockets that can't be made are reported with their folder, and the loops run.
  write_file(folder + "/file", "");
  daemon.write_config("loopwardend.yaml", "runtime_directory: " + folder +
                                              "/file/run\nstate_directory: " + folder +
                                              "\nreal_time: {priority: 0, lock_memory: false}\n");
  daemon.start(std::vector<std::string>{});
  CHECK(eventually([&] {
    const std::string log = daemon.log();
    const std::size_t at = log.find("can't create " + folder + "/file/run");
    return at != std::string::npos && log.find("mode AUTO", at) != std::string::npos;
  }));
  daemon.signal(SIGTERM);
  CHECK(daemon.wait_for_end() == 0);
}

}  // namespace loopwarden::tests::reload_test
