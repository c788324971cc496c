// SPDX-License-Identifier: Apache-2.0
// Tests the sources of a loop's state after its daemon was killed.
#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>
#include <signal.h>
#include <string>

#include "tests/support/daemon_process.hpp"
#include "tests/support/loop_file.hpp"
#include "tests/support/shell.hpp"

namespace loopwarden::tests::restart_test {
namespace {

using nlohmann::json;

constexpr const char* kDaemon = "real_time: {priority: 0, lock_memory: false}\n";

void kill_and_start(DaemonProcess& daemon) {
  daemon.signal(SIGKILL);
  REQUIRE(daemon.wait_for_end() == -SIGKILL);
  daemon.start();
}

int set(const DaemonProcess& daemon, const std::string& arguments) {
  return run("LOOPWARDEN_SOCKET=" + (daemon.folder() / "control.sock").string() +
             " " LOOPWARDEN_CLI " set FIC-101 " + arguments + " 2>&1")
      .exit_code;
}

// Returns the newest line of a restart; null without one.
json restart_line(DaemonProcess& daemon) {
  json found;
  test::eventually([&] {
    for (const json& line : daemon.journal(50, "FIC-101")) {
      if (line.value("what", "") != "restart") continue;
      found = line;
      return true;
    }
    return false;
  });
  return found;
}

}  // namespace

TEST_CASE("after kill -9 a loop continues with its last command, and the journal shows this",
          "[restart]") {
  DaemonProcess daemon(kDaemon, {{"loops.d/1.yaml", loop_file("FIC-101")}});
  daemon.start();
  REQUIRE(set(daemon, "--mode auto --sp 4.5") == 0);
  kill_and_start(daemon);
  CHECK(test::eventually([&] { return daemon.is("FIC-101", "requested_mode", "AUTO"); }));
  CHECK(daemon.loop("FIC-101").at("set_point_wanted") == 4.5);
  const json line = restart_line(daemon);
  REQUIRE_FALSE(line.is_null());
  CHECK_THAT(line.at("new").get<std::string>(), Catch::Contains("AUTO, SP 4.5"));
  // Manual stays manual, whatever the start mode in the file.
  REQUIRE(set(daemon, "--mode man") == 0);
  kill_and_start(daemon);
  CHECK(test::eventually([&] { return daemon.is("FIC-101", "requested_mode", "MAN"); }));
}

TEST_CASE("a loop that was being commissioned when its daemon was killed waits in manual",
          "[restart]") {
  DaemonProcess daemon(kDaemon, {{"loops.d/1.yaml", loop_file("FIC-101")}});
  daemon.start();
  REQUIRE(set(daemon, "--mode auto --sp 4.5") == 0);
  protocol::ask(daemon.client(), protocol::CommissioningRequest{.loop = "FIC-101"});
  REQUIRE(test::eventually([&] {
    return read_file(daemon.folder() / "last-orders.json").find("\"commissioned\":true") !=
           std::string::npos;
  }));
  kill_and_start(daemon);
  CHECK(test::eventually([&] { return daemon.is("FIC-101", "requested_mode", "MAN"); }));
  CHECK(daemon.loop("FIC-101").at("commissioning").is_null());
  CHECK_THAT(restart_line(daemon).at("reason").get<std::string>(),
             Catch::Contains("the loop was being commissioned"));
}

}  // namespace loopwarden::tests::restart_test
