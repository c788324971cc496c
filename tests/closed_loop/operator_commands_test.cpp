// SPDX-License-Identifier: Apache-2.0
// The workbench's commands for operators against the real daemon.
#include <fcntl.h>
#include <poll.h>
#include <pty.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/support/daemon_process.hpp"
#include "tests/support/loop_file.hpp"
#include "tests/support/shell.hpp"

namespace loopwarden::tests::operator_commands_test {
namespace {

using nlohmann::json;

constexpr const char* kDaemon = "real_time: {priority: 0, lock_memory: false}\n";

// A line of bash that finds the daemon by LOOPWARDEN_SOCKET.
ShellOutcome bash(const DaemonProcess& daemon, const std::string& line) {
  return run("LOOPWARDEN_SOCKET=" + (daemon.folder() / "control.sock").string() + " bash -c '" +
             line + "' 2>&1");
}

ShellOutcome loopwarden(const DaemonProcess& daemon, const std::string& arguments) {
  return bash(daemon, LOOPWARDEN_CLI " " + arguments);
}

// The live view on a terminal that the test creates.
class Terminal {
 public:
  explicit Terminal(const std::string& socket) {
    winsize size{.ws_row = 40, .ws_col = 120, .ws_xpixel = 0, .ws_ypixel = 0};
    child_ = ::forkpty(&fd_, nullptr, nullptr, &size);
    REQUIRE(child_ >= 0);
    if (child_ == 0) {
      ::execl(LOOPWARDEN_CLI, LOOPWARDEN_CLI, "top", "--socket", socket.c_str(), nullptr);
      ::_exit(127);
    }
  }
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;
  ~Terminal() {
    if (child_ > 0) {
      ::kill(child_, SIGKILL);
      ::waitpid(child_, nullptr, 0);
    }
    ::close(fd_);
  }

  // Returns whether a picture with `wanted` appears, whatever appeared before this call.
  bool shows(const std::string& wanted, const std::string& without = "\x01") {
    return test::eventually([&] {
      pollfd ready{.fd = fd_, .events = POLLIN, .revents = 0};
      while (::poll(&ready, 1, 0) > 0) {
        std::array<char, 65536> some{};
        const ssize_t n = ::read(fd_, some.data(), some.size());
        if (n <= 0) return false;
        seen_.append(some.data(), static_cast<std::size_t>(n));
        // Each picture begins at the upper left corner.
        const std::size_t last = seen_.rfind("\x1b[H");
        if (last != std::string::npos) seen_.erase(0, last);
      }
      return seen_.find(wanted) != std::string::npos && seen_.find(without) == std::string::npos;
    });
  }
  int quit() {
    REQUIRE(::write(fd_, "q", 1) == 1);
    int status = 0;
    ::waitpid(child_, &status, 0);
    child_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

 private:
  int fd_ = -1;
  pid_t child_ = -1;
  std::string seen_;
};

}  // namespace

TEST_CASE(
    "set and record: unknown names end with 64, refusals of the daemon with 65, no daemon with 74",
    "[operator]") {
  DaemonProcess daemon(kDaemon, {{"loops.d/1.yaml", loop_file("FIC-101")}});
  CHECK(loopwarden(daemon, "set FIC-101 --sp 5").exit_code == 74);
  daemon.start();
  const ShellOutcome unknown = loopwarden(daemon, "set fic-101 --mode man");
  CHECK(unknown.exit_code == 64);
  CHECK(unknown.text.find("did you mean 'FIC-101'?") != std::string::npos);
  const ShellOutcome beyond = loopwarden(daemon, "set FIC-101 --sp 1e6");
  CHECK(beyond.exit_code == 65);
  CHECK(beyond.text.find("must be within") != std::string::npos);
  CHECK(loopwarden(daemon, "set FIC-101 --mode cascade").exit_code == 64);
  CHECK(loopwarden(daemon, "record FIC-999 --start x").exit_code == 64);
  CHECK(loopwarden(daemon, "record FIC-101 --start ../x").exit_code == 65);
  CHECK(loopwarden(daemon, "top --once FIC-999").exit_code == 64);
  CHECK(loopwarden(daemon, "alarms journal FIC-999").exit_code == 64);

  for (const char* word : {"man", "auto", "manual", "automatic", "MAN", "Auto"}) {
    INFO(word);
    const ShellOutcome set = loopwarden(daemon, "set FIC-101 --json --mode " + std::string(word));
    REQUIRE(set.exit_code == 0);
    const json result = json::parse(set.text);
    const bool manual = word[0] == 'm' || word[0] == 'M';
    CHECK(result.at("after").at("requested_mode") == (manual ? "MAN" : "AUTO"));
  }
  const ShellOutcome started = loopwarden(daemon, "record FIC-101 --start mine --json");
  CHECK(json::parse(started.text).at("recording") == true);
  const ShellOutcome stopped = loopwarden(daemon, "record FIC-101 --stop --json");
  CHECK(json::parse(stopped.text).at("file").get<std::string>().ends_with("mine.csv"));
}

TEST_CASE("completion knows the daemon's loops, the alarms, and the words of an option",
          "[operator]") {
  DaemonProcess daemon(kDaemon, {{"loops.d/1.yaml", loop_file("FIC-101")},
                                 {"loops.d/2.yaml", loop_file("FIC-102")}});
  daemon.start();
  const auto completed = [&](const std::string& words) {
    return bash(daemon, "source " LOOPWARDEN_SOURCE_DIR
                        "/workbench/completion/loopwarden; COMP_WORDS=(" LOOPWARDEN_CLI " " +
                            words +
                            "); COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); _loopwarden; "
                            "echo ${COMPREPLY[@]}")
        .text;
  };
  CHECK(completed("set FIC") == "FIC-101 FIC-102\n");
  CHECK(completed("alarms --json shelve FIC-102") == "FIC-102\n");
  CHECK(completed("alarms shelve FIC-101 b") == "backlash bad_pv\n");
  CHECK(completed("register-map --format py") == "pymodbus\n");
  CHECK(completed("classify r.csv --form e") == "explaining\n");
  CHECK(completed("set FIC-101 --mode m") == "man\n");
  CHECK(completed("ga") == "gap\n");
  CHECK(completed("gap --mod") == "--model\n");
}

TEST_CASE("top waits for a restarting daemon and continues", "[operator]") {
  DaemonProcess daemon(kDaemon, {{"loops.d/1.yaml", loop_file("FIC-101")}});
  daemon.start();
  Terminal top((daemon.folder() / "control.sock").string());
  REQUIRE(top.shows("FIC-101"));
  daemon.signal(SIGKILL);
  REQUIRE(daemon.wait_for_end() == -SIGKILL);
  CHECK(top.shows("trying again"));
  CHECK(top.shows("FIC-101"));  // as in the last picture
  daemon.start();
  CHECK(top.shows("FIC-101", "trying again"));
  CHECK(top.quit() == 0);
}

}  // namespace loopwarden::tests::operator_commands_test
