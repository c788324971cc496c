// SPDX-License-Identifier: Apache-2.0
// A host is backed up while it runs and restored, by the commands of
// docs/how-to/back-up-and-restore.md.
#include <signal.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "tests/support/daemon_process.hpp"
#include "tests/support/loop_file.hpp"
#include "tests/support/shell.hpp"

namespace loopwarden::tests::backup_test {
namespace {

using nlohmann::json;

constexpr const char* kDaemon = "real_time: {priority: 0, lock_memory: false}\n";

// Returns each line of the journal, as stored.
std::set<std::string> lines_of(DaemonProcess& daemon) {
  std::set<std::string> lines;
  for (const json& line : daemon.journal(1000)) lines.insert(line.dump());
  return lines;
}

void must(const std::string& command) {
  const ShellOutcome outcome = run(command + " 2>&1");
  INFO(command << "\n" << outcome.text);
  REQUIRE(outcome.exit_code == 0);
}

ShellOutcome loopwarden(const DaemonProcess& daemon, const std::string& arguments) {
  return run("LOOPWARDEN_SOCKET=" + (daemon.folder() / "control.sock").string() +
             " " LOOPWARDEN_CLI " " + arguments + " 2>&1");
}

bool has(const std::set<std::string>& lines, const std::string& word) {
  return std::any_of(lines.begin(), lines.end(),
                     [&](const std::string& line) { return line.find(word) != std::string::npos; });
}

}  // namespace

TEST_CASE(
    "a host is backed up while it runs, and restored with its configuration, journal and alarms",
    "[backup]") {
  DaemonProcess daemon(kDaemon, {{"loops.d/1.yaml", loop_file("FIC-101")}});
  const std::filesystem::path state = daemon.folder();
  const TemporaryFolder backup;
  daemon.start();
  REQUIRE(
      loopwarden(daemon, "alarms shelve FIC-101 stiction --minutes 60 --reason before").exit_code ==
      0);
  REQUIRE(loopwarden(daemon, "set FIC-101 --sp 4.5").exit_code == 0);
  const json hash = daemon.status().at("daemon").at("config_hash");
  const std::set<std::string> before = lines_of(daemon);
  REQUIRE(has(before, "before"));

  must("tar -czf " + (backup / "box.tar.gz").string() + " -C " + state.string() + " config");
  must("sqlite3 " + (state / "journal.sqlite").string() + " '.backup " +
       (backup / "journal.backup").string() + "'");
  must("cp " + (state / "alarm-state.json").string() + " " + backup.path().string());
  // The daemon runs during and after the backup.
  REQUIRE(loopwarden(daemon, "set FIC-101 --sp 3.25").exit_code == 0);
  REQUIRE(has(lines_of(daemon), "3.25"));
  daemon.signal(SIGKILL);
  REQUIRE(daemon.wait_for_end() == -SIGKILL);

  // Simulates a new disk.
  for (const auto& lost : std::filesystem::directory_iterator(state)) {
    std::filesystem::remove_all(lost.path());
  }
  must("tar -xzf " + (backup / "box.tar.gz").string() + " -C " + state.string());
  must("install -m 640 " + (backup / "journal.backup").string() + " " +
       (state / "journal.sqlite").string());
  must("install -m 640 " + (backup / "alarm-state.json").string() + " " + state.string());
  daemon.start();
  CHECK(daemon.status().at("daemon").at("config_hash") == hash);
  CHECK(daemon.status().at("daemon").at("journal").at("damaged") == 0);
  const json alarms = daemon.loop("FIC-101").at("alarms");
  CHECK(alarms.at("stiction").at("state") == "shelved");
  CHECK(alarms.at("backlash").at("state") != "shelved");
  const std::set<std::string> after = lines_of(daemon);
  CHECK(std::includes(after.begin(), after.end(), before.begin(), before.end()));
  CHECK_FALSE(has(after, "3.25"));
  // The restored journal accepts new lines.
  REQUIRE(loopwarden(daemon, "alarms unshelve FIC-101 stiction --reason after").exit_code == 0);
  CHECK(has(lines_of(daemon), "after"));
  daemon.signal(SIGTERM);
  CHECK(daemon.wait_for_end() == 0);
}

}  // namespace loopwarden::tests::backup_test
