// SPDX-License-Identifier: Apache-2.0
// A program of one's own as a child: for work that must not share memory or fate with a daemon.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace loopwarden::base {

struct ChildSettings {
  int input = -1;    // descriptor that it reads; -1: it has no input
  int output = 2;    // descriptor for its output; 2: the caller's standard error
  int errors = -1;   // descriptor for its errors; -1: as its output
  bool idle = true;  // runs only while nothing else wants the processor (SCHED_IDLE)
  std::vector<std::string> environment{};  // NAME=VALUE, in place of the caller's of that name
};

// The child inherits no other files than its input and output, and no blocked signal.
class ChildProcess {
 public:
  // `program`: a path, or a name that PATH tells. `arguments` without it. Throws std::system_error if it can't be started.
  ChildProcess(const std::string& program, const std::vector<std::string>& arguments,
               ChildSettings wanted = {});
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;
  // Kills it if it still runs.
  ~ChildProcess();

  // Its exit code, 128 + signal if a signal ended it; nullopt while it runs.
  std::optional<int> ended();
  pid_t pid() const noexcept { return pid_; }

 private:
  pid_t pid_ = -1;
  std::optional<int> code_;
};

// For such a child itself: idle priority, bounded memory and processor time, gone with its parent. What the system
// refuses of it is left.
void work_in_background(std::size_t most_memory_bytes, std::chrono::seconds most_processor_time);

}  // namespace loopwarden::base
