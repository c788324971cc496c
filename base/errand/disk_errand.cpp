// SPDX-License-Identifier: Apache-2.0
#include "base/errand/disk_errand.hpp"

#include <spdlog/spdlog.h>

namespace loopwarden::base {

DiskErrand::DiskErrand(std::string thread_name, std::size_t stack_bytes)
    : thread_name_(std::move(thread_name)), stack_bytes_(stack_bytes) {}

void DiskErrand::start() {
  if (!thread_.running())
    thread_.start({.name = thread_name_, .stack_bytes = stack_bytes_}, [this] { run(); });
}

void DiskErrand::stop() {
  {
    const std::lock_guard lock(mutex_);
    quit_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

bool DiskErrand::stop_for(std::chrono::milliseconds patience) {
  {
    const std::lock_guard lock(mutex_);
    quit_ = true;
  }
  changed_.notify_all();
  return thread_.join_for(patience);
}

bool DiskErrand::begin_until(std::function<void()> errand, Time deadline) {
  {
    std::unique_lock lock(mutex_);
    if (quit_) return false;
    start();  // two threads may make the first request at the same time
    if (!wait_.hung()) changed_.wait_until(lock, deadline, [&] { return !busy_ || quit_; });
    if (busy_ || quit_) return false;
    errand_ = std::move(errand);
    busy_ = true;
  }
  changed_.notify_all();
  return true;
}

void DiskErrand::run() {
  for (;;) {
    std::function<void()> errand;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [&] { return quit_ || busy_; });
      if (!busy_) return;
      errand = std::move(errand_);
    }
    try {
      const DiskWait::Section waiting(wait_);
      errand();
    } catch (const std::exception& e) {
      spdlog::error("{}: {}", thread_name_, e.what());
    }
    errand = nullptr;  // frees the data of this errand before the next one is accepted
    {
      const std::lock_guard lock(mutex_);
      busy_ = false;
    }
    changed_.notify_all();
  }
}

}  // namespace loopwarden::base
