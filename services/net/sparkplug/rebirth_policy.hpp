// SPDX-License-Identifier: Apache-2.0
// Limits requests for a rebirth. An edge node that does not answer is asked less and less often.
// All requests together stay below a rate that the plant can bear. It uses no clock.
#pragma once

#include <algorithm>
#include <cstdint>

namespace loopwarden::sparkplug {

inline constexpr std::int64_t kFirstRebirthWaitMs = 5'000;
inline constexpr std::int64_t kLongestRebirthWaitMs = 300'000;

// The wait of one edge node.
class RebirthWait {
 public:
  bool may_ask(std::int64_t now_ms) const noexcept { return !asked_ || passed(now_ms) >= wait_ms_; }
  void asked(std::int64_t now_ms) noexcept {
    wait_ms_ = asked_ ? std::min(2 * wait_ms_, kLongestRebirthWaitMs) : kFirstRebirthWaitMs;
    asked_ = true;
    asked_ms_ = now_ms;
  }
  // A birth was received. If the node breaks again at once, the next request still waits.
  void born(std::int64_t now_ms) noexcept {
    if (asked_ && passed(now_ms) >= 2 * kFirstRebirthWaitMs) asked_ = false;
  }

 private:
  // Returns the time since the last request. A clock that was set back counts as stopped.
  std::int64_t passed(std::int64_t now_ms) const noexcept {
    return std::max<std::int64_t>(0, now_ms - asked_ms_);
  }

  bool asked_ = false;
  std::int64_t asked_ms_ = 0;
  std::int64_t wait_ms_ = kFirstRebirthWaitMs;
};

// The rate limit of all edge nodes: a token bucket of `burst` tokens that gains `per_second`.
class RebirthBudget {
 public:
  RebirthBudget(double per_second, double burst) noexcept
      : per_second_(per_second), burst_(burst), left_(burst) {}

  bool take(std::int64_t now_ms) noexcept {
    const double passed_s =
        static_cast<double>(std::max<std::int64_t>(0, now_ms - filled_ms_)) / 1e3;
    left_ = std::min(burst_, left_ + passed_s * per_second_);
    filled_ms_ = now_ms;
    if (left_ < 1.0) return false;
    left_ -= 1.0;
    return true;
  }

 private:
  double per_second_;
  double burst_;
  double left_;
  std::int64_t filled_ms_ = 0;
};

}  // namespace loopwarden::sparkplug
