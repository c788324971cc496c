// SPDX-License-Identifier: Apache-2.0
#include "config/daemon_reader.hpp"

#include "tests/config/config_support.hpp"

namespace daemon_reader_test {

using namespace loopwarden;
using namespace loopwarden::config;
using test::said_of_daemon;

TEST_CASE("The daemon's file fills its settings", "[config][daemon]") {
  const auto daemon = read_daemon_text("/etc/lw/loopwardend.yaml", R"(
real_time: {priority: 50, cpu: 1, lock_memory: false}
accelerate: 10
runtime_directory: run
state_directory: /srv/state
log_level: debug
stop_timeout: 2
links:
  skid: {transport: tcp, host: "::1", port: 1502, connect_timeout: 0.5, response_timeout: 0.2}
  line:
    transport: rtu
    device: /dev/ttyUSB0
    baud: 57600
    parity: none
    stop_bits: 2
    rs485: true
    pause: 0.01
    reconnect_min: 1
    reconnect_max: 60
    probe_interval: 10
)");
  INFO(to_text(daemon.diagnostics));
  REQUIRE(daemon);
  CHECK(daemon->real_time.priority == 50);
  CHECK(daemon->real_time.cpu == 1);
  CHECK_FALSE(daemon->real_time.lock_memory);
  CHECK(daemon->accelerate == 10.0);
  CHECK(daemon->runtime_directory == "/etc/lw/run");
  CHECK(daemon->state_directory == "/srv/state");
  CHECK(daemon->log_level == "debug");
  CHECK(daemon->stop_timeout_s == 2.0);
  REQUIRE(daemon->links.size() == 2);
  const hal::modbus::LinkSettings& skid = daemon->links.at("skid");
  CHECK(skid.name == "skid");
  CHECK(skid.transport == hal::modbus::Transport::tcp);
  CHECK(skid.host == "::1");
  CHECK(skid.port == 1502);
  CHECK(skid.connect_timeout_ms == 500);
  CHECK(skid.response_timeout_ms == 200);
  const hal::modbus::LinkSettings& line = daemon->links.at("line");
  CHECK(line.transport == hal::modbus::Transport::rtu);
  CHECK(line.device == "/dev/ttyUSB0");
  CHECK(line.baud == 57600);
  CHECK(line.parity == hal::modbus::Parity::none);
  CHECK(line.stop_bits == 2);
  CHECK(line.rs485);
  CHECK(line.pause_ms == 10);
  CHECK(line.reconnect_min_s == 1.0);
  CHECK(line.reconnect_max_s == 60.0);
  CHECK(line.probe_interval_s == 10.0);
  CHECK_FALSE(line.response_timeout_ms);
}

TEST_CASE("By default the page's and the edge's socket accept no commands", "[config][daemon]") {
  const auto rights = [](const std::string& text) {
    const auto daemon = read_daemon_text("/etc/lw/loopwardend.yaml", text);
    INFO(to_text(daemon.diagnostics));
    REQUIRE(daemon);
    return std::pair(daemon->page, daemon->edge);
  };
  const SocketRights none;
  CHECK(rights("log_level: info\n") == std::pair(none, none));
  CHECK(rights("page: {}\nedge: {}\n") == std::pair(none, none));
  CHECK(rights("page: {alarms: true}\n") ==
        std::pair(SocketRights{.alarms = true, .control = false}, none));
  CHECK(rights("edge: {control: true}\n") ==
        std::pair(none, SocketRights{.alarms = false, .control = true}));
  CHECK(rights("page: {tuning: true}\n") == std::pair(SocketRights{.tuning = true}, none));
  CHECK(rights("page: {tests: true}\n") == std::pair(SocketRights{.tests = true}, none));
  CHECK(said_of_daemon("edge: {tests: true}\n") == "d.yaml:1:8: error: unknown key 'tests'\n");
  CHECK(said_of_daemon("edge: {tuning: true}\n") == "d.yaml:1:8: error: unknown key 'tuning'\n");
  CHECK(rights("page: {reports: true}\n") == std::pair(SocketRights{.reports = true}, none));
  CHECK(said_of_daemon("edge: {reports: true}\n") == "d.yaml:1:8: error: unknown key 'reports'\n");
  CHECK(said_of_daemon("page: {control: maybe}\n") ==
        "d.yaml:1:17: error: page.control: must be true or false (got 'maybe')\n");
  CHECK(said_of_daemon("page: {controls: true}\n") ==
        "d.yaml:1:8: error: unknown key 'controls'; did you mean 'control'?\n");
}

TEST_CASE("Errors of the daemon's file", "[config][daemon]") {
  CHECK(said_of_daemon("real_time: {priority: 99}\n") ==
        "d.yaml:1:23: error: real_time.priority: must be a whole number from 0 to 98 (got 99)\n");
  CHECK(said_of_daemon("accelerate: 0\n") ==
        "d.yaml:1:13: error: accelerate: must be > 0 and <= 10000 (got 0)\n");
  CHECK(said_of_daemon("log_level: verbose\n") ==
        "d.yaml:1:12: error: log_level: must be debug, info, warn or error (got 'verbose')\n");
}

TEST_CASE("Errors of a link", "[config][daemon]") {
  const auto said_of_link = [](const std::string& keys) {
    return said_of_daemon("links: {a: {" + keys + "}}\n");
  };
  CHECK(said_of_link("transport: tcp") ==
        "d.yaml:1:12: error: missing key 'host' in 'links.a' (text)\n");
  CHECK(said_of_link("transport: tcp, host: plc.example") ==
        "d.yaml:1:35: error: links.a.host: must be a numeric address or localhost (got "
        "'plc.example')\n");
  CHECK(said_of_link("transport: tcp, host: localhost").empty());
  CHECK(said_of_link("transport: tcp, host: 10.0.0.1, baud: 9600") ==
        "d.yaml:1:45: error: unknown key 'baud'\n");
  CHECK(said_of_link("transport: rtu, device: ttyS0") ==
        "d.yaml:1:37: error: links.a.device: must be an absolute path (got 'ttyS0')\n");
  CHECK(said_of_link("transport: rtu, device: /dev/ttyS0, baud: 9601") ==
        "d.yaml:1:55: error: links.a.baud: must be 1200, 2400, 4800, 9600, 19200, 38400, 57600 or "
        "115200 (got '9601'); did you mean '9600'?\n");
  CHECK(said_of_link("transport: serial, device: /dev/ttyS0") ==
        "d.yaml:1:24: error: links.a.transport: must be tcp or rtu (got 'serial')\n");
  CHECK(said_of_link("transport: tcp, host: ::1, reconnect_min: 5, reconnect_max: 2") ==
        "d.yaml:1:73: error: links.a.reconnect_max: must be at least reconnect_min = 5 s (at 1:55) "
        "(got "
        "2)\n");
}

TEST_CASE("One serial device has one link", "[config][daemon]") {
  CHECK(said_of_daemon("links:\n"
                       "  a: {transport: rtu, device: /dev/ttyS0}\n"
                       "  b: {transport: rtu, device: /dev/ttyS0}\n") ==
        "d.yaml:3:31: error: links.b.device: /dev/ttyS0 is the device of link 'a' (at 2:6) as "
        "well; use "
        "one link for both\n");
}

TEST_CASE("The Modbus server's section fills its settings", "[config][daemon]") {
  const auto daemon = read_daemon_text("/etc/lw/loopwardend.yaml", R"(
modbus_server:
  address: 0.0.0.0
  port: 502
  unit: 17
  word_order: cdab
  max_clients: 4
  idle_timeout: 10
  request_rate: 20
  writes: true
  clients:
    - {peer: 192.168.10.0/24}
    - {peer: 192.168.10.5, writes: true}
  master_heartbeat: {timeout: 3, action: manual}
  serial: {device: /dev/ttyS1, baud: 9600, parity: odd, unit: 9, writes: true}
alarms: {latching: true, shelve_limit: 2.5, severe: 15, evidence: 5}
)");
  INFO(to_text(daemon.diagnostics));
  REQUIRE(daemon);
  REQUIRE(daemon->modbus_server);
  const ModbusServer& server = *daemon->modbus_server;
  CHECK(server.address == "0.0.0.0");
  CHECK(server.port == 502);
  CHECK(server.unit == 17);
  CHECK(server.word_order == hal::modbus::ByteOrder::cdab);
  CHECK(server.most_clients == 4);
  CHECK(server.idle_timeout_s == 10.0);
  CHECK(server.requests_per_second == 20.0);
  CHECK(server.writes);
  REQUIRE(server.clients.size() == 2);
  CHECK(server.clients[0].network.bits == 96 + 24);
  CHECK_FALSE(server.clients[0].may_write);
  CHECK(server.clients[1].may_write);
  CHECK(server.master_timeout_s == 3.0);
  CHECK(server.on_master_loss == ModbusServer::LossAction::manual);
  CHECK(daemon->alarms.settings.latching);
  CHECK(daemon->alarms.settings.shelve_limit_ms == 9'000'000);
  CHECK(daemon->alarms.severe_percent == 15.0);
  CHECK(daemon->alarms.most_evidence == 5);
  REQUIRE(server.serial);
  CHECK(server.serial->line.device == "/dev/ttyS1");
  CHECK(server.serial->line.baud == 9600);
  CHECK(server.serial->line.parity == hal::modbus::Parity::odd);
  CHECK(server.serial->unit == 9);
  CHECK(server.serial->writes);
}

TEST_CASE("Without a section there is no Modbus server; an empty one reads only, from this host",
          "[config][daemon]") {
  CHECK_FALSE(read_daemon_text("d.yaml", "log_level: info\n")->modbus_server);
  const auto daemon = read_daemon_text("d.yaml", "modbus_server: {}\n");
  INFO(to_text(daemon.diagnostics));
  REQUIRE(daemon);
  const ModbusServer& server = *daemon->modbus_server;
  CHECK(server.address == "127.0.0.1");
  CHECK(server.port == 1502);
  CHECK_FALSE(server.writes);
  REQUIRE(server.clients.size() == 2);
  for (const base::PeerRule& rule : server.clients) {
    CHECK(rule.network.bits == 128);
    CHECK_FALSE(rule.may_write);
  }
}

TEST_CASE("Errors of a Modbus server are reported at their place", "[config][daemon]") {
  CHECK(said_of_daemon("modbus_server: {address: plc}\n").find("numeric address") !=
        std::string::npos);
  CHECK(said_of_daemon("modbus_server: {clients: [{peer: 10.0.0.1/24}]}\n")
            .find("without bits after its length") != std::string::npos);
  CHECK(said_of_daemon("modbus_server: {clients: [{writes: true}]}\n").find("peer") !=
        std::string::npos);
  CHECK(said_of_daemon("modbus_server: {master_heartbeat: {action: stop}}\n").find("timeout") !=
        std::string::npos);
  CHECK(said_of_daemon("modbus_server: {portt: 502}\n").find("port") != std::string::npos);
  CHECK(said_of_daemon("modbus_server: {serial: {baud: 9600}}\n").find("device") !=
        std::string::npos);
  CHECK(said_of_daemon("modbus_server: {serial: {device: /dev/ttyS1}}\n"
                       "links: {line: {transport: rtu, device: /dev/ttyS1}}\n")
            .find("modbus_server.serial") != std::string::npos);
  CHECK(said_of_daemon("alarms: {shelve_limit: 25}\n").find("24") != std::string::npos);
}

}  // namespace daemon_reader_test
