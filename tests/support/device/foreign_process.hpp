// SPDX-License-Identifier: Apache-2.0
// Runs one of the Python programs in this folder and communicates with it line by line.
#pragma once

#include <poll.h>
#include <sched.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <vector>

namespace loopwarden::test {

class ForeignProcess {
 public:
  // `program` is a file of tests/support/device/. Returns when it has printed its READY line.
  explicit ForeignProcess(const std::string& program, std::vector<std::string> arguments = {}) {
    std::array<int, 2> to{};
    std::array<int, 2> from{};
    if (::pipe(to.data()) != 0 || ::pipe(from.data()) != 0) throw std::runtime_error("no pipe");
    arguments.insert(arguments.begin(), {"/usr/bin/python3",
                                         LOOPWARDEN_SOURCE_DIR "/tests/support/device/" + program});
    std::vector<char*> argv;
    argv.reserve(arguments.size() + 1);
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    child_ = ::fork();
    if (child_ < 0) throw std::runtime_error("no process for " + program);
    if (child_ == 0) {
      ::prctl(PR_SET_PDEATHSIG, SIGKILL);
      ::dup2(to[0], STDIN_FILENO);
      ::dup2(from[1], STDOUT_FILENO);
      for (const int file : {to[0], to[1], from[0], from[1]}) ::close(file);
      // A real device has its own processor and answers in time under any load here. Without the
      // right to real-time priority the program runs at normal priority.
      const sched_param before_all_others{1};
      ::sched_setscheduler(0, SCHED_RR, &before_all_others);
      ::execv(argv[0], argv.data());
      ::_exit(127);
    }
    ::close(to[0]);
    ::close(from[1]);
    input_ = to[1];
    output_ = from[0];
    ready_ = read_line(kPatience);
    if (ready_.rfind("READY", 0) != 0) throw std::runtime_error(program + " says: " + ready_);
  }
  ForeignProcess(const ForeignProcess&) = delete;
  ForeignProcess& operator=(const ForeignProcess&) = delete;
  ~ForeignProcess() {
    ::close(input_);
    ::close(output_);
    ::kill(child_, SIGKILL);
    ::waitpid(child_, nullptr, 0);
  }

  // Sends a command and returns the line that answers it.
  std::string command(const std::string& text) {
    const std::string line = text + "\n";
    if (::write(input_, line.data(), line.size()) != static_cast<ssize_t>(line.size())) {
      throw std::runtime_error("the process takes no command: " + text);
    }
    std::string answer = read_line(kPatience);
    if (answer.empty() || answer.rfind("ERROR", 0) == 0) {
      throw std::runtime_error(text + ": " + answer);
    }
    return answer;
  }

  // Returns the value after `key=` in a line, in the READY line, or in the answer to `state`.
  static std::string field(const std::string& line, const std::string& key) {
    const std::size_t at = line.find(" " + key + "=");
    if (at == std::string::npos) throw std::runtime_error("no " + key + " in: " + line);
    const std::size_t from = at + key.size() + 2;
    return line.substr(from, line.find(' ', from) - from);
  }
  std::string ready(const std::string& key) const { return field(ready_, key); }
  std::string state(const std::string& key) { return field(command("state"), key); }
  double state_number(const std::string& key) { return std::strtod(state(key).c_str(), nullptr); }

  // SIGSTOP and SIGCONT: the process exists but is silent.
  void freeze() const { ::kill(child_, SIGSTOP); }
  void thaw() const { ::kill(child_, SIGCONT); }

 private:
  static constexpr std::chrono::seconds kPatience{60};

  std::string read_line(std::chrono::milliseconds patience) {
    const auto give_up = std::chrono::steady_clock::now() + patience;
    for (;;) {
      const std::size_t end = received_.find('\n');
      if (end != std::string::npos) {
        std::string line = received_.substr(0, end);
        received_.erase(0, end + 1);
        return line;
      }
      const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(
          give_up - std::chrono::steady_clock::now());
      pollfd output{output_, POLLIN, 0};
      if (left.count() <= 0 || ::poll(&output, 1, static_cast<int>(left.count())) <= 0) return {};
      std::array<char, 512> bytes{};
      const ssize_t count = ::read(output_, bytes.data(), bytes.size());
      if (count <= 0) return {};
      received_.append(bytes.data(), static_cast<std::size_t>(count));
    }
  }

  pid_t child_ = -1;
  int input_ = -1;
  int output_ = -1;
  std::string ready_;
  std::string received_;
};

// Waits until `condition` is true. Returns false after `patience`, which is long because it only
// ends a failing test.
template <class Condition>
bool eventually(Condition condition,
                std::chrono::milliseconds patience = std::chrono::seconds(60)) {
  const auto give_up = std::chrono::steady_clock::now() + patience;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > give_up) return false;
    ::usleep(5000);
  }
  return true;
}

}  // namespace loopwarden::test
