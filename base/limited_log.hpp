// SPDX-License-Identifier: Apache-2.0
// Writes lines about links, brokers and feeders to the log, at most one per subject, state and
// minute (line_limiter.hpp). Any thread. A target that includes this file must link spdlog.
#pragma once

#include <spdlog/spdlog.h>

#include <chrono>
#include <mutex>
#include <string>
#include <utility>

#include "base/line_limiter.hpp"

namespace loopwarden::base {

class LimitedLog {
 public:
  void info(const std::string& subject, const std::string& state, std::string text) {
    take(subject, state, {.good = true, .text = std::move(text)});
  }
  void warn(const std::string& subject, const std::string& state, std::string text) {
    take(subject, state, {.good = false, .text = std::move(text)});
  }
  // Writes the withheld lines that are now due. Call it at least every few seconds.
  void look() {
    const std::lock_guard lock(mutex_);
    for (const LimitedLine& line : limiter_.due(std::chrono::steady_clock::now())) write(line);
  }

 private:
  void take(const std::string& subject, const std::string& state, LimitedLine line) {
    const std::lock_guard lock(mutex_);
    const auto now = std::chrono::steady_clock::now();
    if (const auto written = limiter_.take(subject, state, std::move(line), now)) write(*written);
  }
  static void write(const LimitedLine& line) {
    spdlog::log(line.good ? spdlog::level::info : spdlog::level::warn, "{}", line.text);
  }

  std::mutex mutex_;
  LineLimiter limiter_;
};

}  // namespace loopwarden::base
