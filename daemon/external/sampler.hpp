// SPDX-License-Identifier: Apache-2.0
// The thread of the watched loops, `lw-sources`. It runs each loop once per period of that loop, at
// absolute deadlines and with ordinary priority. A late loop keeps its phase and skips whole
// periods.
#pragma once

#include <atomic>
#include <cstdint>
#include <vector>

#include "base/clock.hpp"
#include "base/thread.hpp"
#include "daemon/external/watch_cycle.hpp"

namespace loopwarden::daemon::external {

class Sampler {
 public:
  explicit Sampler(base::Clock& clock) : clock_(clock) {}
  Sampler(const Sampler&) = delete;
  Sampler& operator=(const Sampler&) = delete;
  ~Sampler() { stop(); }

  // Call it before the start. `period_ns` > 0.
  void add(WatchCycle& cycle, std::int64_t period_ns);
  bool empty() const noexcept { return entries_.empty(); }

  void start();
  void stop() noexcept;

  // Runs the loops that are due. Returns the time of the next one, at most kLongestSleep_ns from
  // now. Public for tests.
  std::int64_t round() noexcept;

  // Increases with every round. From any thread.
  std::uint64_t ticks() const noexcept { return ticks_.load(std::memory_order_relaxed); }

 private:
  static constexpr std::int64_t kLongestSleep_ns = 100'000'000;

  struct Entry {
    WatchCycle* cycle;
    std::int64_t period_ns;
    std::uint64_t next_period;  // index of the period that runs next
  };

  base::Clock& clock_;
  std::vector<Entry> entries_;
  std::int64_t started_ns_ = 0;  // 0: before the first round
  std::atomic<bool> quit_{false};
  std::atomic<std::uint64_t> ticks_{0};
  base::Thread thread_;
};

}  // namespace loopwarden::daemon::external
