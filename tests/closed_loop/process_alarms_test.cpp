// SPDX-License-Identifier: Apache-2.0
// Process alarms of the real daemon: an open contact and a PV beyond its limit, each reported once,
// by its cause.
#include <catch2/catch.hpp>
#include <map>
#include <string>

#include "tests/support/daemon_process.hpp"
#include "tests/support/loop_file.hpp"
#include "tests/support/shell.hpp"

namespace loopwarden::tests::process_alarms_test {
namespace {

constexpr const char* kDaemon =
    "real_time: {priority: 0, lock_memory: false}\naccelerate: 20\ncertificates: [no.pem]\n";

std::string loop() {
  std::string text = loop_file("FIC-101");
  const std::string io = "io: {backend: simulated, ";
  text.replace(text.find(io), io.size(),
               io + "io_faults: [{fault: enable_open, from: 60, to: 100000}], ");
  return text +
         "alarms:\n"
         "  pv_low: {limit: 3, on_delay: 2, action: open the bypass}\n"
         "  deviation: {limit: 1, time_constant: 5}\n";
}

ShellOutcome loopwarden(const DaemonProcess& daemon, const std::string& arguments) {
  return run("LOOPWARDEN_SOCKET=" + (daemon.folder() / "control.sock").string() + " " +
             LOOPWARDEN_CLI + " " + arguments + " 2>&1");
}

}  // namespace

TEST_CASE("an open enable contact is reported with the PV limit, but not with the resulting mode",
          "[closed_loop][process_alarms]") {
  DaemonProcess daemon(kDaemon, {{"loops.d/FIC-101.yaml", loop()}});
  daemon.start();
  const auto alarms = [&] {
    std::map<std::string, protocol::Alarm> all;
    workbench::DaemonClient client((daemon.folder() / "control.sock").string());
    for (const protocol::Alarm& one : protocol::ask(client, protocol::AlarmsRequest{}).alarms) {
      all[one.alarm] = one;
    }
    return all;
  };
  std::map<std::string, protocol::Alarm> now;
  REQUIRE(test::eventually([&] {
    now = alarms();
    return now.at("pv_low").active && now.at("enable_open").active;
  }));
  CHECK(now.at("enable_open").first_out);  // though the delay of pv_low is shorter
  CHECK(now.at("not_normal_mode").state == "suppressed");
  CHECK(now.at("not_normal_mode").consequence_of == "enable_open");
  CHECK_FALSE(now.at("deviation").active);
  CHECK(now.find("pv_high") == now.end());  // the file has no limit
  CHECK(now.at("certificate_expires").loop == "box");
  CHECK(now.at("certificate_expires").unacknowledged);

  CHECK_THAT(loopwarden(daemon, "alarms list --rationalised").text,
             Catch::Contains("FIC-101,pv_low,medium,3,0.1,L/min,2,60,") &&
                 Catch::Contains("open the bypass") &&
                 Catch::Contains("box,service_failed,medium,,,,30,60,"));
  CHECK_THAT(loopwarden(daemon, "alarms explain FIC-101 pv_low").text,
             Catch::Contains("Action:       open the bypass"));
  CHECK_THAT(loopwarden(daemon, "alarms ack box certificate_expires").text,
             Catch::Contains("certificate_expires of box: acknowledged"));
  CHECK(test::eventually([&] {
    const std::string told = loopwarden(daemon, "alarms figures --hours 1").text;
    return told.find("FIC-101        pv_low") != std::string::npos &&
           told.find("box            certificate_expires") != std::string::npos;
  }));
}

}  // namespace loopwarden::tests::process_alarms_test
