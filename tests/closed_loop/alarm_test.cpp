// SPDX-License-Identifier: Apache-2.0
// An alarm in the real daemon and its operator, with kill -9 and restart. The journal of an earlier
// run raises the alarm, because a loaded host rarely gives a window of 961 cycles without a missing
// one. tests/daemon/supervision tests how windows raise alarms.
#include <sched.h>

#include <catch2/catch.hpp>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "daemon/journal/journal.hpp"
#include "tests/support/biased_specialists.hpp"
#include "tests/support/daemon_process.hpp"
#include "tests/support/loop_file.hpp"
#include "tests/support/shell.hpp"

namespace loopwarden::tests::alarm_test {
namespace {

using nlohmann::json;

constexpr const char* kDaemon = "real_time: {priority: 0, lock_memory: false}\n";
const std::string kLoop = loop_file("FIC-101");

constexpr const char* kSpecialists = "monitor: {specialists: ../../specialists}\n";

// Leaves the journal of a daemon that had raised an alarm.
void leave_alarm(const std::filesystem::path& folder, const char* alarm = "stiction") {
  daemon::journal::Journal journal({.folder = folder});
  journal.open();
  journal.start();
  daemon::journal::JournalEntry entry;
  entry.kind = daemon::journal::JournalEntry::Kind::alarm;
  entry.utc_ms = 1'800'000'000'000;
  entry.loop = "FIC-101";
  entry.alarm = alarm;
  entry.from = "normal";
  entry.to = "unacknowledged";
  entry.severity_percent = 6.5;
  alarm::AlarmMemory memory;
  memory.raised = alarm::AlarmState::unacknowledged;
  memory.raised_ms = entry.utc_ms;
  memory.times_raised = 1;
  memory.severity_percent = 6.5;
  entry.memory = memory;
  REQUIRE(journal.wait_written(journal.post(entry), std::chrono::seconds(20)));
}

// The daemon's child processes run at idle priority and may get no processor time on a loaded host.
// Raises their priority; needs the right to do so.
void hurry_children_of(pid_t parent) {
  namespace fs = std::filesystem;
  std::error_code gone;
  for (const auto& thread :
       fs::directory_iterator("/proc/" + std::to_string(parent) + "/task", gone)) {
    std::ifstream children(thread.path() / "children");
    for (pid_t child = 0; children >> child;) {
      const sched_param ordinary{};
      ::sched_setscheduler(child, SCHED_OTHER, &ordinary);
    }
  }
}

}  // namespace

TEST_CASE("an alarm is shown, explained, acknowledged, and stays so over kill -9", "[alarm]") {
  DaemonProcess daemon(kDaemon, {{"loops.d/1.yaml", kLoop}});
  leave_alarm(daemon.folder());
  const auto alarms = [&](const std::string& arguments) {
    return run(LOOPWARDEN_CLI " alarms --socket " + (daemon.folder() / "control.sock").string() +
               " " + arguments + " 2>&1");
  };
  const auto state = [&] {
    return daemon.loop("FIC-101").at("alarms").at("stiction").at("state").get<std::string>();
  };

  daemon.start();
  CHECK(state() == "unacknowledged");
  CHECK(alarms("").text.find("unacknowledged") != std::string::npos);
  const ShellOutcome explained = alarms("explain FIC-101 stiction");
  CHECK(explained.text.find("Action:") != std::string::npos);
  CHECK(explained.text.find("normal -> unacknowledged") != std::string::npos);
  CHECK(explained.text.find("evidence: none") != std::string::npos);

  CHECK(alarms("ack FIC-101 backlash").exit_code == 65);  // no alarm to acknowledge
  CHECK(alarms("ack FIC-999 stiction").exit_code == 64);
  CHECK(alarms("ack FIC-101").exit_code == 64);
  const ShellOutcome done = alarms("ack FIC-101 stiction --reason \"seen at the valve\"");
  INFO(done.text);
  REQUIRE(done.exit_code == 0);
  CHECK(state() == "acknowledged");

  const std::string socket = " --socket " + (daemon.folder() / "control.sock").string() + " 2>&1";
  const ShellOutcome found =
      run(LOOPWARDEN_CLI " outcome FIC-101 --found stiction --note \"packing tight\"" + socket);
  INFO(found.text);
  CHECK(found.exit_code == 0);
  CHECK(found.text.find("stiction found; the daemon's finding: stiction") != std::string::npos);
  CHECK(run(LOOPWARDEN_CLI " outcome FIC-999 --found air" + socket).exit_code == 64);

  daemon.signal(SIGKILL);
  REQUIRE(daemon.wait_for_end() == -SIGKILL);
  daemon.start();
  CHECK(state() == "acknowledged");
  CHECK(alarms("journal FIC-101").text.find("seen at the valve") != std::string::npos);
  CHECK(run(LOOPWARDEN_CLI " outcome --list" + socket).text.find("packing tight") !=
        std::string::npos);

  // Killed once more, with a damaged journal: acknowledged alarms stay acknowledged.
  daemon.signal(SIGKILL);
  REQUIRE(daemon.wait_for_end() == -SIGKILL);
  write_file(daemon.folder() / "journal.sqlite", std::string(20'000, 'x'));
  daemon.start();
  CHECK(state() == "acknowledged");
  CHECK(daemon.status().at("daemon").at("journal").at("damaged") == 1);
  CHECK(test::eventually([&] { return daemon.is("FIC-101", "mode", "AUTO"); }));
  CHECK(test::eventually(
      [&] { return alarms("journal").text.find("journal replaced") != std::string::npos; }));
  CHECK(alarms("veto FIC-101").text.find("no corrective action") != std::string::npos);

  REQUIRE(alarms("shelve FIC-101 stiction --minutes 30").exit_code == 0);
  CHECK(state() == "shelved");
  CHECK(alarms("").text.find("30 min left") != std::string::npos);
  REQUIRE(alarms("unshelve FIC-101 stiction").exit_code == 0);
  CHECK(state() == "unacknowledged");
  daemon.signal(SIGTERM);
  CHECK(daemon.wait_for_end() == 0);
}

TEST_CASE("the size of an unknown fault is shown as unknown, not as 0", "[alarm]") {
  DaemonProcess daemon(kDaemon, {{"loops.d/1.yaml", kLoop}});
  leave_alarm(daemon.folder(), "unknown");
  daemon.start();
  CHECK(daemon.loop("FIC-101").at("alarms").at("unknown").at("severity_percent").is_null());
  const std::string socket = " --socket " + (daemon.folder() / "control.sock").string();
  const auto text_of = [&](const std::string& command) {
    const ShellOutcome outcome = run(LOOPWARDEN_CLI " " + command + socket + " 2>&1");
    INFO(outcome.text);
    CHECK(outcome.exit_code == 0);
    return outcome.text;
  };
  CHECK_THAT(text_of("alarms"), Catch::Contains("unknown         low               - "));
  CHECK_THAT(text_of("alarms explain FIC-101 unknown"), Catch::Contains("size not known"));
  CHECK_THAT(text_of("top --once"), Catch::Contains("unknown (unacknowledged)"));
}

TEST_CASE("specialists that can't be used are refused before anything moves", "[alarm]") {
  DaemonProcess daemon(kDaemon, {{"loops.d/1.yaml", kLoop + kSpecialists}});
  SECTION("valid") {
    write_biased_specialists(daemon.folder() / "specialists", specialist::Condition::stiction);
    CHECK(daemon.run({"--config", daemon.config().string(), "--check"}) == 0);
    return;
  }
  SECTION("missing") {}
  SECTION("of another sample time") {
    write_biased_specialists(daemon.folder() / "specialists", specialist::Condition::stiction, 1.0);
  }
  CHECK(daemon.run({"--config", daemon.config().string(), "--check"}) == 78);
  CHECK(daemon.run({"--config", daemon.config().string()}) == 78);
  CHECK(read_file(daemon.folder() / "output").find("specialists") != std::string::npos);
}

TEST_CASE("a changed loop raises model_gap, and its explanation is made without a request",
          "[alarm][idle][long]") {
  // The fault lasts half an hour, longer than its explanation takes on a loaded host.
  const auto model = [](const std::string& faults) {
    return "sample_time: 0.1\n"
           "controller: {kp: 0.35, ki: 0.04, output: [0, 10]}\n"
           "process: {gain: 1.2264, time_constant: 1.69376, dead_time: 2.6256}\n"
           "transmitter: {range: [0, 10], resolution: 0.00244140625, noise: 0.01}\n"
           "scenario: {duration: 40000, set_point: [[0, 5]], faults: [" +
           faults + "], seed: 1}\n";
  };
  DaemonProcess daemon("real_time: {priority: 0, lock_memory: false}\naccelerate: 20\n",
                       {{"loops.d/1.yaml", loop_file("FIC-101", "../../plant.yaml") +
                                               "monitor: {twin: ../../twin.yaml}\n"}});
  write_file(daemon.folder() / "plant.yaml",
             model("{effect: gain_change, factor: 0.7, block: process, from: 200}"));
  write_file(daemon.folder() / "twin.yaml", model(""));
  std::string loop = read_file(daemon.config() / "loops.d/1.yaml");
  loop.replace(loop.find("recovery:"), 0, "late_cycle_periods: 1000, ");
  daemon.write_config("loops.d/1.yaml", loop);
  daemon.start();
  const std::string socket = " --socket " + (daemon.folder() / "control.sock").string();
  const auto explained = [&] { return daemon.explain("FIC-101", "model_gap"); };
  // Only a moving loop separates another gain from a load.
  const auto start = std::chrono::steady_clock::now();
  double set_point = 5.0;
  const auto move_set_point = [&] {
    const auto minutes = (std::chrono::steady_clock::now() - start) / std::chrono::seconds(3);
    const double wanted = minutes % 2 == 0 ? 5.0 : 6.0;
    if (wanted == std::exchange(set_point, wanted)) return;
    run(LOOPWARDEN_CLI " set FIC-101 --sp " + std::to_string(wanted) + socket);
  };
  const auto is_explained = [&] {
    move_set_point();
    hurry_children_of(daemon.pid());
    return explained().at("explanation").is_object();
  };
  INFO(daemon.log());
  REQUIRE(test::eventually(is_explained, std::chrono::minutes(10)));
  const json answer = explained();
  const json& e = answer.at("explanation");
  INFO(answer.dump(1));
  CHECK(answer.at("alarm").at("state") == "unacknowledged");
  CHECK(e.at("alarm") == "model_gap");
  CHECK(e.at("final_name").is_null());
  CHECK_FALSE(e.at("sentence").get<std::string>().empty());
  const std::filesystem::path folder = e.at("folder").get<std::string>();
  CHECK(folder == answer.at("evidence").get<std::string>());
  for (const char* file : {"minutes.csv", "twin.yaml", "explanation.json", "report.html"}) {
    CHECK(std::filesystem::exists(folder / file));
  }
  const ShellOutcome text = run(LOOPWARDEN_CLI " alarms explain FIC-101 model_gap" + socket);
  CHECK(text.text.find("against the twin") != std::string::npos);
  // One action: that of the explanation.
  CHECK_THAT(text.text, Catch::Contains("Action:       " + e.at("remedy").get<std::string>()) &&
                            !Catch::Contains("  Action: "));
  CHECK(run(LOOPWARDEN_CLI " alarms journal FIC-101" + socket).text.find("explanation") !=
        std::string::npos);
  // The explanation is there after a restart, too, or a newer one of the same name.
  daemon.signal(SIGKILL);
  REQUIRE(daemon.wait_for_end() == -SIGKILL);
  daemon.start();
  CHECK(explained().at("explanation").at("effect") == e.at("effect"));
  // An explanation that was pending when the daemon ended is made after the restart, from the saved
  // data.
  daemon.signal(SIGKILL);
  REQUIRE(daemon.wait_for_end() == -SIGKILL);
  REQUIRE(std::filesystem::remove(folder / "explanation.json"));
  daemon.start();
  REQUIRE(test::eventually(is_explained, std::chrono::minutes(10)));
  CHECK(explained().at("explanation").at("effect") == e.at("effect"));
}

}  // namespace loopwarden::tests::alarm_test
