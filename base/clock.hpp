// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace loopwarden::base {

inline constexpr std::int64_t kNanosecondsPerSecond = 1'000'000'000;

// Time source of everything that waits, so that tests can run the daemon's loops on a fake clock.
class Clock {
 public:
  virtual ~Clock() = default;
  // Nanoseconds of a clock that never jumps.
  virtual std::int64_t now_ns() noexcept = 0;
  // Returns at or after the instant; at once if it has passed.
  virtual void sleep_until_ns(std::int64_t deadline_ns) noexcept = 0;
};

// CLOCK_MONOTONIC and clock_nanosleep to an absolute deadline.
class MonotonicClock final : public Clock {
 public:
  std::int64_t now_ns() noexcept override;
  void sleep_until_ns(std::int64_t deadline_ns) noexcept override;
};

// UTC in ms since 1970, by the computer's clock, which may be set.
std::int64_t utc_ms() noexcept;

}  // namespace loopwarden::base
