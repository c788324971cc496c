// SPDX-License-Identifier: Apache-2.0
// Runs a program as a child process, with its output in a log.
#pragma once

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/temporary_folder.hpp"

namespace loopwarden::tests {

// `words[0]` is the program's file. The program ends with the test. Its output is appended to
// `log`.
inline pid_t spawn(std::vector<std::string> words, const std::filesystem::path& log) {
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  const pid_t child = ::fork();
  if (child < 0) throw std::runtime_error("no process for " + words[0]);
  if (child == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    const int file = ::open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0644);
    ::dup2(file, STDOUT_FILENO);
    ::dup2(file, STDERR_FILENO);
    ::execv(argv[0], argv.data());
    ::_exit(127);
  }
  return child;
}

// Returns the exit code, or -signal.
inline int outcome_of(int status) {
  return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

class Program {
 public:
  // Does not start it yet.
  Program(std::vector<std::string> words, std::filesystem::path log)
      : words_(std::move(words)), log_(std::move(log)) {}
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;
  ~Program() { end(SIGKILL); }

  void start() { child_ = spawn(words_, log_); }
  // Sends the signal and waits for the end. Returns the exit code or -signal, or 0 if no program
  // runs.
  int end(int number) {
    if (child_ <= 0) return 0;
    signal(number);
    int status = 0;
    ::waitpid(child_, &status, 0);
    child_ = -1;
    return outcome_of(status);
  }
  void signal(int number) const {
    if (child_ > 0) ::kill(child_, number);
  }
  std::string log() const {
    return std::filesystem::exists(log_) ? read_file(log_) : std::string();
  }

 private:
  std::vector<std::string> words_;
  std::filesystem::path log_;
  pid_t child_ = -1;
};

}  // namespace loopwarden::tests
