// SPDX-License-Identifier: Apache-2.0
// A thread that does one disk operation (a task) at a time for threads that must not wait for
// the disk. If the disk hangs, only this thread hangs.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "base/disk_wait.hpp"
#include "base/thread.hpp"

namespace loopwarden::base {

class BlockingWorker {
 public:
  explicit BlockingWorker(std::string thread_name,
                          std::size_t stack_bytes = ThreadOptions{}.stack_bytes);
  BlockingWorker(const BlockingWorker&) = delete;
  BlockingWorker& operator=(const BlockingWorker&) = delete;
  ~BlockingWorker() { stop(); }

  // Starts the thread. Without this call, the first task starts it.
  void start();
  void stop();
  // Requests the thread to end and waits for at most `patience`. Returns false if its disk hangs.
  bool stop_for(std::chrono::milliseconds patience);

  // Hands the task over. Returns false, without running it, if the last one is not finished. The
  // task must own all its data, because the caller may be gone when it ends.
  bool begin(std::function<void()> task) {
    return begin_until(std::move(task), std::chrono::steady_clock::now());
  }
  // Runs `task` and returns its result or rethrows its exception. Returns nullopt if it has not
  // finished after `patience`, which includes the wait for the task before it.
  template <class Result>
  std::optional<Result> ask(std::function<Result()> task, std::chrono::milliseconds patience);

  // Returns the duration of the present task so far, s; 0: no task runs.
  double seconds() const noexcept { return wait_.seconds(); }

 private:
  using Time = std::chrono::steady_clock::time_point;
  bool begin_until(std::function<void()> task, Time deadline);
  void run();

  std::string thread_name_;
  std::size_t stack_bytes_;
  DiskWait wait_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::function<void()> task_;
  bool busy_ = false;
  bool quit_ = false;
  base::Thread thread_;
};

template <class Result>
std::optional<Result> BlockingWorker::ask(std::function<Result()> task,
                                          std::chrono::milliseconds patience) {
  struct Answer {
    std::mutex mutex;
    std::condition_variable there;
    std::optional<Result> result;
    std::exception_ptr error;
  };
  const auto answer = std::make_shared<Answer>();
  const Time deadline = std::chrono::steady_clock::now() + patience;
  const auto work = [answer, task = std::move(task)] {
    std::optional<Result> result;
    std::exception_ptr error;
    try {
      result = task();
    } catch (...) {
      error = std::current_exception();
    }
    const std::lock_guard lock(answer->mutex);
    answer->result = std::move(result);
    answer->error = error;
    answer->there.notify_all();
  };
  if (!begin_until(work, deadline)) return std::nullopt;
  std::unique_lock lock(answer->mutex);
  answer->there.wait_until(lock, deadline, [&] { return answer->result || answer->error; });
  if (answer->error) std::rethrow_exception(answer->error);
  return std::move(answer->result);
}

}  // namespace loopwarden::base
