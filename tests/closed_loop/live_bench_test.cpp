// SPDX-License-Identifier: Apache-2.0
// valve-test and autotune on a loop of the real daemon: their measurements, and the return of the
// loop to its old state however they end.
#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/support/daemon_process.hpp"
#include "tests/support/loop_file.hpp"

namespace loopwarden::tests::live_bench_test {
namespace {

using nlohmann::json;

// With real-time rights the loops have priority, because a valve test depends on time.
std::string daemon_yaml(double accelerate) {
  return "real_time: {lock_memory: false}\naccelerate: " + std::to_string(accelerate) + "\n";
}

// A late cycle on a loaded host is no fault of the loop.
std::string patient_loop(const std::string& tag, const std::string& model,
                         const std::string& start) {
  std::string text = loop_file(tag, model, start);
  const std::string before = "recovery: previous_mode";
  return text.replace(text.find(before), before.size(), "late_cycle_periods: 1000, " + before);
}

// Plant 1 without noise; its valve answers at once, or sticks with 4 % of the CO span.
std::string model_file(bool sticking) {
  return std::string("sample_time: 0.1\n") +
         "controller: {action: reverse, kp: 0.3494, ki: 0.0400074, output: [0, 10]}\n" +
         "valve: {effects: [" + (sticking ? "{effect: stiction, s: 0.4, j: 0.2}" : "") + "]}\n" +
         "process: {gain: 1.2264, time_constant: 1.69376, dead_time: 2.6256}\n" +
         "transmitter: {range: [0, 10], resolution: 0, noise: 0}\n";
}

// Runs a command of the workbench from its start to its end.
class Command {
 public:
  Command(DaemonProcess& daemon, std::vector<std::string> arguments)
      : output_(daemon.folder() / "command") {
    arguments.insert(arguments.begin(), LOOPWARDEN_CLI);
    arguments.insert(arguments.end(), {"--socket", (daemon.folder() / "control.sock").string()});
    std::vector<char*> argv;
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    child_ = ::fork();
    if (child_ < 0) throw std::runtime_error("no process for loopwarden");
    if (child_ == 0) {
      ::prctl(PR_SET_PDEATHSIG, SIGKILL);
      const int file = ::open(output_.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
      ::dup2(file, STDOUT_FILENO);
      ::dup2(file, STDERR_FILENO);
      ::execv(argv[0], argv.data());
      ::_exit(127);
    }
  }
  Command(const Command&) = delete;
  Command& operator=(const Command&) = delete;
  ~Command() {
    if (child_ <= 0) return;
    ::kill(child_, SIGKILL);
    ::waitpid(child_, nullptr, 0);
  }

  void signal(int number) const { ::kill(child_, number); }
  // True from just before its first command on.
  bool catches_interrupts() const {
    const std::string status = read_file("/proc/" + std::to_string(child_) + "/status");
    const std::size_t mask = status.find("SigCgt:");
    // Before that program begins, its process has the handlers of this one.
    return status.starts_with("Name:\tloopwarden\n") && mask != std::string::npos &&
           (std::stoull(status.substr(mask + 7), nullptr, 16) >> (SIGINT - 1) & 1U) != 0;
  }
  int wait_for_end() {
    int status = 0;
    if (!test::eventually([&] { return ::waitpid(child_, &status, WNOHANG) == child_; },
                          std::chrono::minutes(5))) {
      return -1;
    }
    child_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }
  std::string text() const {
    return std::filesystem::exists(output_) ? read_file(output_) : std::string();
  }

 private:
  std::filesystem::path output_;
  pid_t child_ = -1;
};

std::vector<std::string> valve_test(const std::string& loop, std::vector<std::string> more) {
  more.insert(more.begin(), {"valve-test", loop, "--live"});
  return more;
}

// Returns true if the loop is in automatic at its set point, as before the test.
bool as_it_was(DaemonProcess& daemon, const std::string& loop) {
  const json now = daemon.loop(loop);
  return now.value("requested_mode", "") == "AUTO" && now.value("mode", "") == "AUTO" &&
         now.at("sp") == 5.0;
}

bool settled(DaemonProcess& daemon, const std::string& loop) {
  const json now = daemon.loop(loop);
  return now.value("mode", "") == "AUTO" && now.at("pv").is_number() &&
         std::abs(now.at("pv").get<double>() - 5.0) < 0.1;
}

// Waits until the loop is in manual, and sets its output to `co`.
void stand_at(DaemonProcess& daemon, const std::string& loop, double co) {
  REQUIRE(test::eventually([&] { return daemon.is(loop, "mode", "MAN"); }));
  daemon.client().set({.loop = loop, .output = co});
  REQUIRE(test::eventually([&] {
    const json now = daemon.loop(loop);
    return now.at("co") == co && now.at("pv").is_number() && now.at("pv") > 1.1 * co;
  }));
}

const std::string kAutomatic = "{mode: automatic, set_point: 5}";

}  // namespace

TEST_CASE("a live step test measures the valve and restores output, mode and set point",
          "[live_bench]") {
  // A late command costs more of the loop's time at a higher speed: a hold is 2 s here.
  DaemonProcess daemon(daemon_yaml(5.0),
                       {{"healthy.yaml", model_file(false)},
                        {"loops.d/1.yaml", patient_loop("FIC-101", "../healthy.yaml", kAutomatic)},
                        {"loops.d/2.yaml", patient_loop("FIC-102", "../healthy.yaml",
                                                        "{mode: manual, set_point: 5}")}});
  daemon.start();
  REQUIRE(test::eventually([&] { return settled(daemon, "FIC-101"); }, std::chrono::seconds(120)));
  const std::string out = (daemon.folder() / "out").string();
  const std::vector<std::string> step{"--low",  "3",         "--high", "5",      "--pv-low",
                                      "0",      "--pv-high", "10",     "--test", "step_change",
                                      "--hold", "10",        "--out",  out};
  Command automatic(daemon, valve_test("FIC-101", step));
  const int exit_code = automatic.wait_for_end();
  INFO(automatic.text());
  REQUIRE(exit_code == 0);
  CHECK(automatic.text().find("mode auto") != std::string::npos);
  CHECK(test::eventually([&] { return as_it_was(daemon, "FIC-101"); }));
  const json steps =
      json::parse(read_file(daemon.folder() / "out/valve-test.json")).at("tests").at("step_change");
  CHECK(steps.at("up_travel").get<double>() == Approx(1.0).margin(1e-6));
  CHECK(steps.at("down_travel").get<double>() == Approx(-1.0).margin(1e-6));

  stand_at(daemon, "FIC-102", 4.25);
  Command manual(daemon, valve_test("FIC-102", step));
  const int manual_exit = manual.wait_for_end();
  INFO(manual.text());
  REQUIRE(manual_exit == 0);
  CHECK(test::eventually([&] {
    const json now = daemon.loop("FIC-102");
    return now.value("requested_mode", "") == "MAN" && now.at("co") == 4.25;
  }));
}

TEST_CASE("a sticking valve is reported with the figures of its commissioning", "[live_bench]") {
  // A late command costs more of the loop's time at a higher speed: a hold is 0.6 s here.
  DaemonProcess daemon(daemon_yaml(5.0),
                       {{"healthy.yaml", model_file(false)},
                        {"sticking.yaml", model_file(true)},
                        {"loops.d/1.yaml", patient_loop("FIC-101", "../healthy.yaml",
                                                        "{mode: manual, set_point: 5}")},
                        {"loops.d/2.yaml", patient_loop("FIC-102", "../sticking.yaml",
                                                        "{mode: manual, set_point: 5}")}});
  daemon.start();
  stand_at(daemon, "FIC-101", 4.0);
  stand_at(daemon, "FIC-102", 4.0);
  const auto scan = [&](const std::string& loop, const std::vector<std::string>& more) {
    std::vector<std::string> arguments = valve_test(
        loop, {"--low", "2", "--high", "6", "--pv-low", "-1", "--pv-high", "11", "--test",
               "static_scan", "--hold", "3", "--out", (daemon.folder() / loop).string()});
    arguments.insert(arguments.end(), more.begin(), more.end());
    Command command(daemon, arguments);
    const int exit_code = command.wait_for_end();
    INFO(command.text());
    REQUIRE(exit_code == 0);
    return command.text();
  };
  const auto dead_band = [&](const std::string& loop) {
    return json::parse(read_file(daemon.folder() / loop / "valve-test.json"))
        .at("tests")
        .at("static_scan")
        .at("dead_band_percent")
        .get<double>();
  };
  scan("FIC-101", {});
  CHECK(dead_band("FIC-101") < 0.1);
  const std::string text = scan(
      "FIC-102", {"--commissioning", (daemon.folder() / "FIC-101" / "valve-test.json").string()});
  CHECK(dead_band("FIC-102") > 1.0);
  const std::size_t line = text.find("dead_band_percent  ");
  REQUIRE(line != std::string::npos);
  CHECK(text.substr(line, text.find('\n', line) - line).find("at commissioning") !=
        std::string::npos);
  CHECK(read_file(daemon.folder() / "FIC-102" / "report.html").find("commissioning") !=
        std::string::npos);
}

TEST_CASE("PV beyond its limit, a signal and an operator each end a live test", "[live_bench]") {
  DaemonProcess daemon(
      daemon_yaml(25.0),
      {{"healthy.yaml", model_file(false)},
       {"loops.d/1.yaml", patient_loop("FIC-101", "../healthy.yaml", kAutomatic)}});
  daemon.start();
  const auto ready = [&] {
    REQUIRE(
        test::eventually([&] { return settled(daemon, "FIC-101"); }, std::chrono::seconds(120)));
  };
  const auto in_test = [&] {
    return test::eventually([&] { return daemon.is("FIC-101", "mode", "MAN"); });
  };
  const std::vector<std::string> long_test{"--low",    "3",           "--high",    "5",
                                           "--pv-low", "0",           "--pv-high", "10",
                                           "--test",   "static_scan", "--hold",    "1000"};
  SECTION("PV") {
    ready();
    Command command(
        daemon, valve_test("FIC-101", {"--low", "3", "--high", "7", "--pv-low", "3", "--pv-high",
                                       "6", "--test", "step_change", "--hold", "10"}));
    const int exit_code = command.wait_for_end();
    INFO(command.text());
    CHECK(exit_code == 75);
    CHECK(command.text().find("is outside of 3 to 6") != std::string::npos);
    CHECK(test::eventually([&] { return as_it_was(daemon, "FIC-101"); }));
    // The loop runs again: PV returns to the set point.
    ready();
  }
  SECTION("signals") {
    for (const int number : {SIGINT, SIGTERM, SIGHUP}) {
      ready();
      Command command(daemon, valve_test("FIC-101", long_test));
      REQUIRE(in_test());
      command.signal(number);
      const int exit_code = command.wait_for_end();
      INFO("signal " << number << ": " << command.text());
      CHECK(exit_code == 75);
      CHECK(command.text().find("interrupted") != std::string::npos);
      CHECK(test::eventually([&] { return as_it_was(daemon, "FIC-101"); }));
    }
  }
  SECTION("an operator keeps the loop that the operator took") {
    ready();
    Command command(daemon, valve_test("FIC-101", long_test));
    // Its first output is on its way when it has seen that the loop is in manual.
    REQUIRE(test::eventually([&] {
      const json lines = daemon.journal(50, "FIC-101");
      return std::any_of(lines.begin(), lines.end(),
                         [](const json& line) { return line.at("what") == "output"; });
    }));
    CHECK_THROWS_WITH(daemon.client().set({.loop = "FIC-101", .mode = "auto"}),
                      Catch::Contains("out of service"));
    daemon.client().set({.loop = "FIC-101", .mode = "man"});
    const int exit_code = command.wait_for_end();
    INFO(command.text());
    CHECK(exit_code == 75);
    CHECK(command.text().find("taken to manual by another user") != std::string::npos);
    CHECK(daemon.loop("FIC-101").value("requested_mode", "") == "MAN");
  }
  SECTION("a loop outside of the limits is not moved") {
    ready();
    Command command(daemon, valve_test("FIC-101", {"--low", "7", "--high", "9", "--pv-low", "0",
                                                   "--pv-high", "10", "--test", "step_change"}));
    CHECK(command.wait_for_end() == 75);
    CHECK(command.text().find("outside the given limits") != std::string::npos);
    CHECK(command.text().find("output back") == std::string::npos);
    CHECK(as_it_was(daemon, "FIC-101"));
  }
}

TEST_CASE("a command to manual that is still on its way when the test ends is withdrawn",
          "[live_bench]") {
  // A cycle of 2 s: the loop takes the command long after it was sent.
  std::string slow = patient_loop("FIC-101", "../slow.yaml", kAutomatic);
  slow.replace(slow.find("sample_time: 0.1"), 16, "sample_time: 2");
  std::string model = model_file(false);
  model.replace(model.find("sample_time: 0.1"), 16, "sample_time: 2");
  DaemonProcess daemon(daemon_yaml(1.0), {{"slow.yaml", model}, {"loops.d/1.yaml", slow}});
  daemon.start();
  REQUIRE(test::eventually([&] { return daemon.is("FIC-101", "mode", "AUTO"); }));
  Command command(daemon, valve_test("FIC-101", {"--low", "0", "--high", "10", "--pv-low", "-1",
                                                 "--pv-high", "11", "--test", "step_change"}));
  REQUIRE(test::eventually([&] { return command.catches_interrupts(); }));
  command.signal(SIGINT);
  const int exit_code = command.wait_for_end();
  INFO(command.text());
  CHECK(exit_code == 75);
  // Changes to manual and back.
  REQUIRE(test::eventually([&] {
    const json lines = daemon.journal(50, "FIC-101");
    return std::count_if(lines.begin(), lines.end(),
                         [](const json& line) { return line.at("what") == "mode"; }) >= 2;
  }));
  CHECK(test::eventually([&] { return as_it_was(daemon, "FIC-101"); }));
}

TEST_CASE("autotune on a live loop finds the ultimate gain and restores the loop", "[live_bench]") {
  // The relay switches late by the round trip. At a higher speed this is more of the loop's time.
  DaemonProcess daemon(
      daemon_yaml(4.0),
      {{"healthy.yaml", model_file(false)},
       {"loops.d/1.yaml", patient_loop("FIC-101", "../healthy.yaml", kAutomatic)}});
  daemon.start();
  REQUIRE(test::eventually([&] { return settled(daemon, "FIC-101"); }, std::chrono::seconds(120)));
  const std::vector<std::string> tune{
      "autotune", "FIC-101",   "--live", "--low",       "2",   "--high",       "6",    "--pv-low",
      "2",        "--pv-high", "8",      "--amplitude", "0.5", "--hysteresis", "0.05", "--json"};
  SECTION("to its end") {
    Command command(daemon, tune);
    const int exit_code = command.wait_for_end();
    const std::string text = command.text();
    INFO(text);
    REQUIRE(exit_code == 0);
    const json found = json::parse(text.substr(text.find('{')));
    // For K 1.2264, T 1.694 s, L 2.626 s: 1.40 and 7.9 s.
    CHECK(found.at("ultimate_gain").get<double>() == Approx(1.4).epsilon(0.35));
    CHECK(found.at("ultimate_period_s").get<double>() == Approx(7.9).epsilon(0.35));
    CHECK(text.find("mode auto") != std::string::npos);
  }
  SECTION("interrupted") {
    Command command(daemon, tune);
    REQUIRE(test::eventually([&] { return daemon.is("FIC-101", "mode", "MAN"); }));
    command.signal(SIGINT);
    CHECK(command.wait_for_end() == 75);
    CHECK(command.text().find("interrupted") != std::string::npos);
  }
  CHECK(test::eventually([&] { return as_it_was(daemon, "FIC-101"); }));
}

}  // namespace loopwarden::tests::live_bench_test
