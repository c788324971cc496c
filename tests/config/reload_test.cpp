// SPDX-License-Identifier: Apache-2.0
#include "config/reload.hpp"

#include "tests/config/config_support.hpp"

namespace reload_test {

using namespace loopwarden;
using namespace loopwarden::config;
using test::kLoopHead;
using test::ScratchFolder;
using test::with;

namespace {

const std::string kDaemon = R"(links:
  skid: {transport: tcp, host: 127.0.0.1}
  spare: {transport: tcp, host: 127.0.0.2}
modbus_server: {port: 1502, clients: [{peer: 10.0.0.5}], serial: {device: /dev/ttyS3, unit: 4}}
alarms: {latching: false, severe: 10}
)";
std::string modbus_loop() {
  return with(test::kModbusLoop, "  output: {unit: V",
              "  jacket: {form: bounded, shadow: true, valve_position: {model: [{effect: backlash, "
              "deadband: 0.2}]}}\n  output: {unit: V") +
         "monitor: {overlap: 0.5}\n";
}
const std::string kAnalogLoop =
    test::kAnalogLoop + "  read_back: {device: adc, channel: voltage1}\n";
const std::string kReplayLoop = kLoopHead + "io: {backend: replay, record: ../r.csv}\n";
const std::string kSimLoop = kLoopHead + "io: {backend: simulated, model: ../m.yaml}\n";

// Always from the same folder, so that the same paths mean the same.
Configuration read(const std::string& daemon, const std::string& loop,
                   const std::string& model = test::kModel) {
  static const ScratchFolder folder;
  folder.write("loopwardend.yaml", daemon);
  folder.write("loops.d/a.yaml", loop);
  folder.write("m.yaml", model);
  folder.write("r.csv", "time,pv\n0,1\n0.1,1\n0.2,1\n");
  auto configuration = read_configuration(folder.path());
  INFO(to_text(configuration.diagnostics));
  REQUIRE(configuration);
  return std::move(*configuration);
}

std::vector<std::string> keys(const Configuration& running, const Configuration& wanted) {
  std::vector<std::string> all;
  for (const Waiting& waiting : waiting_for_restart(running, wanted)) all.push_back(waiting.key);
  return all;
}

using Keys = std::vector<std::string>;

// What waits when one place of the loop's file changes.
Keys after(const std::string& loop, const std::string& from, const std::string& to) {
  return keys(read(kDaemon, loop), read(kDaemon, with(loop, from, to)));
}
Keys after_daemon(const std::string& from, const std::string& to) {
  return keys(read(kDaemon, modbus_loop()), read(with(kDaemon, from, to), modbus_loop()));
}

}  // namespace

TEST_CASE("What a reload takes over does not wait", "[config][reload]") {
  CHECK(after(modbus_loop(), "kp: 0.35", "kp: 0.5").empty());
  CHECK(after(modbus_loop(), "stop: 1", "stop: hold").empty());
  CHECK(after(modbus_loop(), "limits: [0, 9]", "limits: [0, 8]").empty());
  CHECK(after(modbus_loop(), "limits: [1, 9]}", "limits: [1, 9], rate_limit: 2}").empty());
  CHECK(after(modbus_loop(), "range: [0, 10]}", "range: [0, 10], frozen_after: 5}").empty());
  CHECK(after(modbus_loop(), "form: bounded", "form: dwell").empty());
  CHECK(after_daemon("links:", "log_level: warn\nstop_timeout: 8\nlinks:").empty());
  CHECK(after_daemon("links:", "page: {alarms: true, control: true}\nedge: {alarms: true}\nlinks:")
            .empty());
}

TEST_CASE("What a reload can't take over of a loop is named by its key, and nothing else is",
          "[config][reload]") {
  CHECK(after(modbus_loop(), "loop: FIC-101", "loop: FIC-101\ndescription: feed") ==
        Keys{"description"});
  CHECK(after(modbus_loop(), "unit: L/min", "unit: m3/h") == Keys{"process_variable.unit"});
  CHECK(after(modbus_loop(), "unit: V", "unit: mA") == Keys{"controller.output.unit"});
  CHECK(after(modbus_loop(), "deadband: 0.2", "deadband: 0.3") ==
        Keys{"controller.jacket.valve_position"});
  CHECK(after(modbus_loop(), "start: {mode: manual", "start: {mode: automatic") == Keys{"start"});
  CHECK(after(modbus_loop(), "monitor:", "alarms: {normal_mode: manual}\nmonitor:") ==
        Keys{"alarms.normal_mode"});
  CHECK(after(modbus_loop(), "overlap: 0.5", "overlap: 0.25") == Keys{"monitor.overlap"});
  CHECK(after(modbus_loop(), "overlap: 0.5", "decimation: 2") == Keys{"monitor.decimation"});
  CHECK(after(modbus_loop(), "overlap: 0.5", "specialists: s") == Keys{"monitor.specialists"});
  CHECK(after(modbus_loop(), "monitor:", "recording: {enabled: false}\nmonitor:") ==
        Keys{"recording.enabled"});
  CHECK(after(modbus_loop(), "monitor:", "recording: {limit_mb: 10}\nmonitor:") ==
        Keys{"recording.limit_mb"});
  CHECK(after(modbus_loop(), "address: 100", "address: 101") == Keys{"io"});
  CHECK(after(modbus_loop(), "link: skid", "link: spare") == Keys{"io"});
  CHECK(after(kAnalogLoop, "voltage0", "voltage3") == Keys{"io"});
  CHECK(after(kReplayLoop, "r.csv", "r.csv, repeat: true") == Keys{"io"});
  CHECK(after(kReplayLoop, "replay, record: ../r.csv", "simulated, model: ../m.yaml") ==
        Keys{"io.backend"});
  CHECK(keys(read(kDaemon, kSimLoop), read(kDaemon, kSimLoop, with(test::kModel, "1.7", "1.8"))) ==
        Keys{"io.model"});
}

TEST_CASE("What follows from another key is not blamed on io", "[config][reload]") {
  CHECK(after(modbus_loop(), "sample_time: 0.1", "sample_time: 0.2") == Keys{"sample_time"});
  CHECK(after(kAnalogLoop, "sample_time: 0.1", "sample_time: 0.2") == Keys{"sample_time"});
  CHECK(after(kAnalogLoop, "L/min, range: [0, 10]", "L/min, range: [0, 12]") ==
        Keys{"process_variable.range"});
  CHECK(after(kAnalogLoop, "unit: V, range: [0, 10]", "unit: V, range: [0, 12]") ==
        Keys{"controller.output.range"});
  CHECK(after(modbus_loop(), "unit: V, range: [0, 10]", "unit: V, range: [0, 12]") ==
        Keys{"controller.output.range"});
  CHECK(after(kReplayLoop, "unit: V, range: [0, 10]", "unit: V, range: [0, 12]") ==
        Keys{"controller.output.range"});
  CHECK(after_daemon("host: 127.0.0.1", "host: 127.0.0.3") == Keys{"links.skid"});
}

TEST_CASE("What a reload can't take over of loopwardend.yaml is named by its key",
          "[config][reload]") {
  CHECK(after_daemon("links:", "real_time: {priority: 60, cpu: 1, lock_memory: false}\nlinks:") ==
        Keys{"real_time.priority", "real_time.cpu", "real_time.lock_memory"});
  CHECK(keys(read(kDaemon, kSimLoop), read("accelerate: 2\n" + kDaemon, kSimLoop)) ==
        Keys{"accelerate"});
  CHECK(
      after_daemon("links:", "runtime_directory: /run/x\nstate_directory: /var/x\nlinks:").size() ==
      2);
  CHECK(after_daemon("port: 1502", "port: 1503") == Keys{"modbus_server.port"});
  CHECK(
      after_daemon("port: 1502",
                   "address: 0.0.0.0, unit: 2, word_order: cdab, max_clients: 3, idle_timeout: 9, "
                   "request_rate: 7, writes: true, master_heartbeat: {timeout: 5}") ==
      Keys{"modbus_server.address", "modbus_server.unit", "modbus_server.word_order",
           "modbus_server.max_clients", "modbus_server.idle_timeout", "modbus_server.request_rate",
           "modbus_server.writes", "modbus_server.master_heartbeat"});
  CHECK(after_daemon("10.0.0.5", "10.0.0.6") == Keys{"modbus_server.clients"});
  CHECK(after_daemon("unit: 4", "unit: 5") == Keys{"modbus_server.serial"});
  CHECK(after_daemon("modbus_server: {port: 1502, clients: [{peer: 10.0.0.5}], serial: {device: "
                     "/dev/ttyS3, unit: 4}}\n",
                     "") == Keys{"modbus_server"});
  CHECK(after_daemon("alarms: {latching: false, severe: 10}",
                     "alarms: {latching: true, severe: 12, shelve_limit: 4, evidence: 20}") ==
        Keys{"alarms.latching", "alarms.shelve_limit", "alarms.severe", "alarms.evidence"});
  CHECK(after_daemon("  spare: {transport: tcp, host: 127.0.0.2}\n", "") == Keys{"links.spare"});
  CHECK(after_daemon("links:", "links:\n  third: {transport: tcp, host: ::1}") ==
        Keys{"links.third"});
}

TEST_CASE("Loops that came and went are named with their files", "[config][reload]") {
  const Configuration one = read(kDaemon, modbus_loop());
  const Configuration other = read(kDaemon, with(modbus_loop(), "FIC-101", "FIC-102"));
  const std::vector<Waiting> waiting = waiting_for_restart(one, other);
  REQUIRE(waiting.size() == 2);
  CHECK(to_text(waiting[0]) ==
        other.loops[0].file + ": loop: loop FIC-102 is new; it needs a restart");
  CHECK(to_text(waiting[1]) ==
        one.loops[0].file +
            ": loop: loop FIC-101 is gone from the files; it runs on until a restart");
}

TEST_CASE("The text of a configuration is that of its files in their order", "[config][reload]") {
  CHECK(read(kDaemon, kSimLoop).text == kDaemon + kSimLoop);
}

}  // namespace reload_test
