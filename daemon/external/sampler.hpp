// SPDX-License-Identifier: Apache-2.0
// The thread of the watched loops, `lw-sources`: runs each once a period of its own, at absolute deadlines, with ordinary
// priority. What comes late keeps its phase and leaves whole periods out.
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

  // Before the start only. `period_ns` > 0.
  void add(WatchCycle& cycle, std::int64_t period_ns);
  bool empty() const noexcept { return entries_.empty(); }

  void start();
  void stop() noexcept;

  // One look: runs what is due; returns when the next is, at most kLongestSleep_ns from now. Public for tests.
  std::int64_t round() noexcept;

  // Any thread: grows with every look.
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
  std::int64_t started_ns_ = 0;  // 0: no look yet
  std::atomic<bool> quit_{false};
  std::atomic<std::uint64_t> ticks_{0};
  base::Thread thread_;
};

}  // namespace loopwarden::daemon::external
