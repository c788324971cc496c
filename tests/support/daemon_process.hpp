// SPDX-License-Identifier: Apache-2.0
// The real loopwardend as a child process, with a temporary configuration folder.
#pragma once

#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "daemon/protocol/ask.hpp"
#include "tests/support/device/foreign_process.hpp"
#include "tests/support/program.hpp"
#include "tests/support/temporary_folder.hpp"
#include "workbench/live/daemon_client.hpp"

namespace loopwarden::tests {

class DaemonProcess {
 public:
  // `files` by their path below the configuration folder; runtime and state folders are added to
  // `daemon_yaml`, the content of loopwardend.yaml. Does not start it yet.
  DaemonProcess(const std::string& daemon_yaml, const std::map<std::string, std::string>& files) {
    write_config("loopwardend.yaml", "runtime_directory: " + folder_.path().string() +
                                         "\nstate_directory: " + folder_.path().string() + "\n" +
                                         daemon_yaml);
    for (const auto& [name, text] : files) write_config(name, text);
  }
  DaemonProcess(const DaemonProcess&) = delete;
  DaemonProcess& operator=(const DaemonProcess&) = delete;
  ~DaemonProcess() {
    if (child_ > 0) {
      ::kill(child_, SIGKILL);
      ::waitpid(child_, nullptr, 0);
    }
  }

  void write_config(const std::string& name, const std::string& text) {
    write_file(config() / name, text);
  }
  std::filesystem::path config() const { return folder_ / "config"; }
  const std::filesystem::path& folder() const { return folder_.path(); }
  // Empty before the daemon has written it.
  std::string log() const {
    return std::filesystem::exists(folder_ / "log") ? read_file(folder_ / "log") : std::string();
  }

  // Starts it and waits until it answers.
  void start() {
    child_ = spawn({"--config", config().string()}, "log");
    if (!test::eventually([&] { return answers(); }))
      throw std::runtime_error("no answer: " + log());
  }
  // Starts it with more arguments, without waiting.
  void start(const std::vector<std::string>& more) {
    std::vector<std::string> arguments{"--config", config().string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    child_ = spawn(std::move(arguments), "log");
  }
  bool running() const {
    siginfo_t info{};
    return ::waitid(P_PID, static_cast<id_t>(child_), &info, WEXITED | WNOHANG | WNOWAIT) == 0 &&
           info.si_pid == 0;
  }
  bool answers() {
    try {
      client_.emplace((folder_ / "control.sock").string());
      status();
      return true;
    } catch (const std::exception&) {
      return false;
    }
  }

  pid_t pid() const noexcept { return child_; }
  void signal(int number) const { ::kill(child_, number); }
  // Returns the exit code of the daemon, -1 if it does not end, or -signal if a signal killed it.
  int wait_for_end(std::chrono::milliseconds patience = std::chrono::seconds(60)) {
    int status = 0;
    const bool ended =
        test::eventually([&] { return ::waitpid(child_, &status, WNOHANG) == child_; }, patience);
    if (!ended) return -1;
    child_ = -1;
    return outcome_of(status);
  }
  // Runs the program with other arguments to its end and returns its exit code.
  int run(const std::vector<std::string>& arguments, const std::string& output = "output") {
    const pid_t other = spawn(arguments, output);
    int status = 0;
    ::waitpid(other, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

  workbench::DaemonClient& client() { return *client_; }
  // Returns the answers as they were sent.
  nlohmann::json status() { return client_->ask(protocol::StatusRequest{}); }
  nlohmann::json loop(const std::string& name) {
    const nlohmann::json all = status();
    for (const auto& loop : all.at("loops")) {
      if (loop.at("name") == name) return loop;
    }
    throw std::runtime_error("no loop " + name);
  }
  // Returns the newest lines, newest first. An empty `loop` means all loops.
  nlohmann::json journal(std::uint64_t most, const std::string& loop = {}) {
    protocol::JournalRequest request{.most = most};
    if (!loop.empty()) request.loop = loop;
    return client_->ask(request).at("lines");
  }
  nlohmann::json explain(const std::string& loop, const std::string& alarm) {
    return client_->ask(protocol::ExplainRequest{.loop = loop, .alarm = alarm});
  }
  protocol::Trend trend(const std::string& loop) {
    return protocol::ask(*client_, protocol::TrendRequest{.loop = loop});
  }
  void acknowledge(const std::string& loop, const std::string& alarm) {
    protocol::ask(*client_,
                  protocol::AlarmRequest{.loop = loop, .alarm = alarm, .action = "acknowledge"});
  }
  bool is(const std::string& loop_name, const char* key, const std::string& value) {
    return loop(loop_name).value(key, std::string()) == value;
  }

 private:
  pid_t spawn(std::vector<std::string> arguments, const std::string& output) {
    // The environment can select another build of it, such as a sanitizer's.
    const char* other = std::getenv("LOOPWARDEN_DAEMON");
    arguments.insert(arguments.begin(),
                     other != nullptr ? other : LOOPWARDEN_BIN_DIR "/loopwardend");
    return tests::spawn(std::move(arguments), folder_ / output);
  }

  TemporaryFolder folder_;
  pid_t child_ = -1;
  std::optional<workbench::DaemonClient> client_;
};

}  // namespace loopwarden::tests
