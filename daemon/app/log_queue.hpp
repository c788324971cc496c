// SPDX-License-Identifier: Apache-2.0
// The log's way out: lines go into a bounded queue, and a thread of its own writes them to a file
// descriptor. Where the log's reader or disk hangs, no thread that logs hangs with it.
#pragma once

#include <spdlog/sinks/base_sink.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <string>

#include "base/thread.hpp"

namespace loopwarden::daemon {

class LogQueue final : public spdlog::sinks::base_sink<std::mutex> {
 public:
  // Writes to `fd`, which it does not close. Keeps the first `most_lines` that can't be written yet.
  explicit LogQueue(int fd, std::size_t most_lines = 2000);
  LogQueue(const LogQueue&) = delete;
  LogQueue& operator=(const LogQueue&) = delete;
  ~LogQueue() override;

  // Writes what is waiting and ends the thread; false if that takes longer than `patience`.
  bool stop_for(std::chrono::milliseconds patience);
  // Lines that found no room.
  std::uint64_t lost() const noexcept { return lost_.load(std::memory_order_relaxed); }

 protected:
  void sink_it_(const spdlog::details::log_msg& message) override;
  void flush_() override {}

 private:
  void run();

  int fd_;
  std::size_t most_lines_;
  std::mutex lines_mutex_;  // held for copies in memory only
  std::condition_variable changed_;
  std::deque<std::string> lines_;
  bool quit_ = false;
  std::atomic<std::uint64_t> lost_{0};
  base::Thread thread_;
};

}  // namespace loopwarden::daemon
