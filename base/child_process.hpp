// SPDX-License-Identifier: Apache-2.0
// Runs a program of this project as a child process, for work that must not share memory with a
// daemon and must not end it.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace loopwarden::base {

struct ChildSettings {
  int input = -1;    // descriptor that the child reads; -1: no input
  int output = 2;    // descriptor for its output; 2: the caller's standard error
  int errors = -1;   // descriptor for its errors; -1: same as its output
  bool idle = true;  // run only while the processor is otherwise idle (SCHED_IDLE)
  std::vector<std::string> environment{};  // NAME=VALUE, replaces the caller's variable of that
                                           // name
};

// The child inherits no other files than its input and output, and no blocked signal.
class ChildProcess {
 public:
  // `program`: a path, or a name to be found in PATH. `arguments`: without the program's name.
  // Throws std::system_error if it can't be started.
  ChildProcess(const std::string& program, const std::vector<std::string>& arguments,
               ChildSettings wanted = {});
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;
  // Kills it if it still runs.
  ~ChildProcess();

  // Returns its exit code, or 128 + signal if a signal ended it; nullopt while it runs.
  std::optional<int> ended();
  pid_t pid() const noexcept { return pid_; }

 private:
  pid_t pid_ = -1;
  std::optional<int> code_;
};

// Sets up the calling process as a background child: idle priority, limited memory and processor
// time, killed when its parent ends. Limits that the system refuses are skipped.
void work_in_background(std::size_t most_memory_bytes, std::chrono::seconds most_processor_time);

}  // namespace loopwarden::base
