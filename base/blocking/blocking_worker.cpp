// SPDX-License-Identifier: Apache-2.0
#include "base/blocking/blocking_worker.hpp"

#include <spdlog/spdlog.h>

namespace loopwarden::base {

BlockingWorker::BlockingWorker(std::string thread_name, std::size_t stack_bytes)
    : thread_name_(std::move(thread_name)), stack_bytes_(stack_bytes) {}

void BlockingWorker::start() {
  if (!thread_.running())
    thread_.start({.name = thread_name_, .stack_bytes = stack_bytes_}, [this] { run(); });
}

void BlockingWorker::stop() {
  ask_to_end(mutex_, quit_, changed_);
  thread_.join();
}

bool BlockingWorker::stop_for(std::chrono::milliseconds patience) {
  ask_to_end(mutex_, quit_, changed_);
  return thread_.join_for(patience);
}

bool BlockingWorker::begin_until(std::function<void()> task, Time deadline) {
  {
    std::unique_lock lock(mutex_);
    if (quit_) return false;
    start();  // two threads may make the first request at the same time
    if (!wait_.hung()) changed_.wait_until(lock, deadline, [&] { return !busy_ || quit_; });
    if (busy_ || quit_) return false;
    task_ = std::move(task);
    busy_ = true;
  }
  changed_.notify_all();
  return true;
}

void BlockingWorker::run() {
  for (;;) {
    std::function<void()> task;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [&] { return quit_ || busy_; });
      if (!busy_) return;
      task = std::move(task_);
    }
    try {
      const DiskWait::Section waiting(wait_);
      task();
    } catch (const std::exception& e) {
      spdlog::error("{}: {}", thread_name_, e.what());
    }
    task = nullptr;  // frees the data of this task before the next one is accepted
    {
      const std::lock_guard lock(mutex_);
      busy_ = false;
    }
    changed_.notify_all();
  }
}

}  // namespace loopwarden::base
