// SPDX-License-Identifier: Apache-2.0
// Computes the pause before the loops start again after repeated failures. The service manager
// starts the daemon after every failure, without limit. A daemon that fails again and again would
// otherwise move its valves every few seconds. During the pause the outputs stay at their stop
// actions.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <utility>

#include "base/back_off.hpp"

namespace loopwarden::daemon {

class RestartPause {
 public:
  // Starts that follow each other without a pause.
  static constexpr std::int64_t kAtOnce = 4;
  // A run of this length is no failed start.
  static constexpr std::chrono::minutes kHealthy{10};
  static constexpr base::BackOff kBackOff{.first = std::chrono::seconds(2),
                                          .longest = std::chrono::seconds(60)};

  // `file` counts the starts. It must not survive a boot. An unreadable file counts as missing.
  explicit RestartPause(std::filesystem::path file) : file_(std::move(file)) {}

  // Counts a start at `now` (monotonic). Returns the pause before it, chosen by `chance` from 0 to
  // 1 (BackOff).
  std::chrono::milliseconds count_start(std::chrono::nanoseconds now, double chance) const;
  // Forgets all starts. Call it after an end that was requested.
  void forget() const noexcept;

 private:
  std::filesystem::path file_;
};

}  // namespace loopwarden::daemon
