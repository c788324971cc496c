// SPDX-License-Identifier: Apache-2.0
// The log of the daemon as the journal of systemd reads it.
#include <sys/stat.h>

#include <catch2/catch.hpp>
#include <cstdlib>
#include <sstream>
#include <string>

#include "tests/support/daemon_process.hpp"
#include "tests/support/loop_file.hpp"

namespace loopwarden::tests::log_test {
namespace {

constexpr const char* kDaemon = "real_time: {priority: 0, lock_memory: false}\n";

bool has(const DaemonProcess& daemon, const std::string& text) {
  return daemon.log().find(text) != std::string::npos;
}

}  // namespace

TEST_CASE("for the journal, each line of the log has its priority and no time", "[log]") {
  DaemonProcess daemon(std::string(kDaemon) + "feeders: {program: {user: root}}\n",
                       {{"loops.d/1.yaml", loop_file("FIC-101")}});
  write_file(daemon.folder() / "log", "");
  write_file(daemon.folder() / "feed.sock" / "content", "");
  struct stat status {};
  REQUIRE(::stat((daemon.folder() / "log").c_str(), &status) == 0);
  const std::string stream = std::to_string(status.st_dev) + ":" + std::to_string(status.st_ino);
  ::setenv("JOURNAL_STREAM", stream.c_str(), 1);
  daemon.start();
  ::unsetenv("JOURNAL_STREAM");
  REQUIRE(test::eventually([&] { return has(daemon, "<6>running 1 loop\n"); }));
  // "feed.sock" is a folder with content: an error.
  CHECK(has(daemon, "<3>feed.sock: "));
  std::istringstream lines(daemon.log());
  for (std::string line; std::getline(lines, line);) {
    INFO(line);
    CHECK(line.starts_with("<"));
  }
}

TEST_CASE("elsewhere a line has its time and level, and a healthy start reports no end of a fault",
          "[log]") {
  DaemonProcess daemon(kDaemon, {{"loops.d/1.yaml", loop_file("FIC-101")}});
  daemon.start();
  REQUIRE(test::eventually([&] { return has(daemon, "Z info running 1 loop\n"); }));
  CHECK_FALSE(has(daemon, "fault over"));
}

}  // namespace loopwarden::tests::log_test
