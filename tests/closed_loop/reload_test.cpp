// SPDX-License-Identifier: Apache-2.0
// After a reload, whoever looks is told what is in force: status, registers and log of the real daemon.
#include <catch2/catch.hpp>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "hal/os/local_socket.hpp"
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
  json status() { return daemon.client().status().at("daemon"); }
  json configuration() { return status().at("configuration"); }
  std::uint32_t shown_hash() { return status().at("config_hash").get<std::uint32_t>(); }
  // By a master that is none of this project.
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
  // CRC-32 of the files as they are now, by a program that is none of this project.
  std::uint32_t hash_of_files() {
    const std::string folder = daemon.config().string();
    return static_cast<std::uint32_t>(
        std::stoul(output_of("cat " + folder + "/loopwardend.yaml " + folder +
                             "/loops.d/*.yaml | python3 -c 'import sys, zlib; "
                             "print(zlib.crc32(sys.stdin.buffer.read()))'")));
  }
  // Reloads, and waits until the files of now have been looked at.
  void reload() {
    const std::string before = daemon.log();
    daemon.signal(SIGHUP);
    REQUIRE(eventually([&] {
      const std::string said = daemon.log().substr(before.size());
      return said.find("has its new settings") != std::string::npos ||
             said.find("reload refused") != std::string::npos;
    }));
    REQUIRE(eventually([&] {
      return !configuration().at("refused").get<std::string>().empty() ||
             configuration().at("files_hash") == hash_of_files();
    }));
  }
  std::set<std::string> waiting() {
    std::set<std::string> keys;
    const json configuration_now = configuration();
    for (const json& w : configuration_now.at("waiting_for_restart")) keys.insert(w.at("key"));
    return keys;
  }

  const std::string loop = loop_file("FIC-101", "../m.yaml");
  int port;
  DaemonProcess daemon;
};

}  // namespace

TEST_CASE(
    "after a good reload status and register show the hash of the new files, after a bad one that "
    "of the old",
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
    "what a reload does not take over is named in log and status, and the hash is that of no set "
    "of "
    "files",
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
  for (const char* key : {"loopwardend.yaml: alarms.severe: ", "1.yaml: recording.enabled: ",
                          "1.yaml: monitor.overlap: "}) {
    CHECK_THAT(log, Catch::Contains(key));
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

TEST_CASE("after a reload of the ranges the status shows those that the registers are scaled by",
          "[reload]") {
  Plant plant;
  const auto scaled_set_point = [&] { return plant.input_register(80, ""); };
  plant.daemon.write_config("m.yaml", replaced(kModel, "range: [0, 10]", "range: [0, 20]"));
  plant.daemon.write_config("loops.d/1.yaml",
                            replaced(plant.loop, "range: [0, 10]", "range: [0, 20]"));
  plant.reload();
  const json loop = plant.daemon.loop("FIC-101");
  CHECK(loop.at("pv_range") == json({0.0, 20.0}));
  CHECK(loop.at("co_range") == json({0.0, 10.0}));
  CHECK(scaled_set_point() == 2500);
  CHECK(plant.waiting() == std::set<std::string>{"process_variable.range", "io.model"});
}

TEST_CASE("a reload gives the page its rights and takes them, and nothing waits for a restart",
          "[reload]") {
  Plant plant;
  const std::string socket = plant.daemon.folder().string() + "/page.sock";
  const std::string order =
      R"({"request":"set","loop":"FIC-101","set_point":6,"user":"anna","address":"10.0.0.5"})";
  const auto told = [&](hal::os::LocalClient& page) {
    return json::parse(page.request(order, std::chrono::seconds(30)));
  };
  CHECK_FALSE(std::filesystem::exists(socket));
  plant.write_daemon("page: {alarms: true}\n");
  plant.reload();
  CHECK(plant.waiting().empty());
  REQUIRE(eventually([&] { return std::filesystem::exists(socket); }));
  hal::os::LocalClient page(socket);
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
  // One that can't be made: said with its name.
  write_file(folder + "/file", "");
  daemon.write_config("loopwardend.yaml", "runtime_directory: " + folder +
                                              "/file/run\nstate_directory: " + folder + "\n");
  CHECK(daemon.run({"--config", daemon.config().string()}) == 74);
  CHECK_THAT(read_file(folder + "/output"),
             Catch::Contains("runtime_directory " + folder + "/file"));
}

}  // namespace loopwarden::tests::reload_test
