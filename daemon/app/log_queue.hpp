// SPDX-License-Identifier: Apache-2.0
// Writes the log: lines enter a bounded queue, and a separate thread writes them to a file
// descriptor. Threads that log never wait for a reader or a disk that hangs.
#pragma once

#include <spdlog/sinks/base_sink.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <mutex>
#include <string>

#include "base/thread.hpp"

namespace loopwarden::daemon {

class LogQueue final : public spdlog::sinks::base_sink<std::mutex> {
 public:
  // Writes to `fd`, which it does not close. Keeps up to `most_lines` unwritten lines; further
  // lines are lost.
  explicit LogQueue(int fd, std::size_t most_lines = 2000);
  LogQueue(const LogQueue&) = delete;
  LogQueue& operator=(const LogQueue&) = delete;
  ~LogQueue() override;

  // Writes the waiting lines and ends the thread. Returns false if that takes longer than
  // `patience`.
  bool stop_for(std::chrono::milliseconds patience);
  // Lines that did not fit into the queue.
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
