// SPDX-License-Identifier: Apache-2.0
// Repeats an action that can fail, such as opening a socket, until it succeeds. The log shows the
// first failure, each new reason, and the success after a failure. A target that includes this file
// must link spdlog.
#pragma once

#include <spdlog/spdlog.h>

#include <chrono>
#include <exception>
#include <mutex>
#include <string>
#include <utility>

namespace loopwarden::base {

class RepeatedAttempt {
 public:
  using Moment = std::chrono::steady_clock::time_point;
  static constexpr std::chrono::seconds kPause{1};

  // `name`: of the part, for the log and problem().
  explicit RepeatedAttempt(std::string name) : name_(std::move(name)) {}
  RepeatedAttempt(const RepeatedAttempt&) = delete;
  RepeatedAttempt& operator=(const RepeatedAttempt&) = delete;
  ~RepeatedAttempt() = default;

  // Calls `action`, unless it failed less than kPause ago. Returns true if it was called and threw
  // no exception.
  template <class Action>
  bool run(Action action, Moment now = std::chrono::steady_clock::now()) {
    if (now < next_) return false;
    try {
      action();
    } catch (const std::exception& e) {
      next_ = now + kPause;
      if (change(e.what())) spdlog::error("{}: {}; next attempt in 1 s", name_, e.what());
      return false;
    }
    next_ = {};
    if (change({})) spdlog::info("{}: works again", name_);
    return true;
  }
  // Ends the attempts: the part is no longer needed.
  void give_up() {
    next_ = {};
    change({});
  }

  // Returns "NAME: reason" of the last failure; empty without one. From any thread.
  std::string problem() const {
    const std::lock_guard lock(mutex_);
    return why_.empty() ? std::string() : name_ + ": " + why_;
  }

 private:
  // Returns true if the reason differs from the last one.
  bool change(std::string why) {
    const std::lock_guard lock(mutex_);
    if (why == why_) return false;
    why_ = std::move(why);
    return true;
  }

  std::string name_;
  Moment next_{};
  mutable std::mutex mutex_;
  std::string why_;
};

}  // namespace loopwarden::base
