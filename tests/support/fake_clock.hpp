// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>

#include "base/clock.hpp"

namespace loopwarden::tests {

// A clock that only advances during a sleep. A sleep ends `late_ns` later than requested.
// `on_sleep` can stop the thread under test.
class FakeClock final : public base::Clock {
 public:
  std::int64_t now_ns() noexcept override { return now_ns_; }
  void sleep_until_ns(std::int64_t deadline_ns) noexcept override {
    if (deadline_ns > now_ns_) now_ns_ = deadline_ns;
    if (late_ns) now_ns_ += late_ns(sleeps_);
    ++sleeps_;
    if (on_sleep) on_sleep(sleeps_);
  }

  std::function<std::int64_t(std::uint64_t sleep)> late_ns;
  std::function<void(std::uint64_t sleeps)> on_sleep;

 private:
  std::int64_t now_ns_ = 1'000'000'000;
  std::uint64_t sleeps_ = 0;
};

}  // namespace loopwarden::tests
