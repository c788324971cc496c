// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pthread.h>

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <functional>
#include <mutex>
#include <optional>
#include <string>

namespace loopwarden::base {

struct ThreadOptions {
  std::string name;                          // at most 15 characters, as ps and top show it
  int fifo_priority = 0;                     // SCHED_FIFO priority 1..99; 0: ordinary scheduling
  std::optional<int> cpu = std::nullopt;     // pin to this CPU
  std::size_t stack_bytes = 256UL * 1024UL;  // locked in memory when used
};

// A thread with a name, a priority and a fixed stack size. It is joined on destruction.
class Thread {
 public:
  Thread() = default;
  Thread(const Thread&) = delete;
  Thread& operator=(const Thread&) = delete;
  ~Thread() { join(); }

  // Starts `body`. If the priority or the CPU is refused, the thread runs without it, and the
  // returned text names the refusal. Returns an empty text otherwise. Throws std::system_error if
  // the thread can't be started at all.
  std::string start(const ThreadOptions& options, std::function<void()> body);
  void join() noexcept;
  // Joins, but waits for at most `patience`. Returns false if the thread still runs.
  bool join_for(std::chrono::milliseconds patience) noexcept;
  bool running() const noexcept { return started_; }

 private:
  pthread_t handle_{};
  bool started_ = false;
};

// Sets `quit` under its mutex and wakes the thread that waits for `changed`.
inline void ask_to_end(std::mutex& mutex, bool& quit, std::condition_variable& changed) {
  {
    const std::lock_guard lock(mutex);
    quit = true;
  }
  changed.notify_all();
}

}  // namespace loopwarden::base
