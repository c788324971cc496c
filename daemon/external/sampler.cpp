// SPDX-License-Identifier: Apache-2.0
#include "daemon/external/sampler.hpp"

#include <algorithm>

namespace loopwarden::daemon::external {

void Sampler::add(WatchCycle& cycle, std::int64_t period_ns) {
  entries_.push_back({.cycle = &cycle, .period_ns = period_ns, .next_period = 0});
}

void Sampler::start() {
  thread_.start({.name = "lw-sources"}, [this] {
    while (!quit_.load(std::memory_order_relaxed)) clock_.sleep_until_ns(round());
  });
}

void Sampler::stop() noexcept {
  quit_ = true;
  thread_.join();
}

std::int64_t Sampler::round() noexcept {
  const std::int64_t now_ns = clock_.now_ns();
  if (started_ns_ == 0) started_ns_ = now_ns;
  std::int64_t next_ns = now_ns + kLongestSleep_ns;
  for (Entry& entry : entries_) {
    const auto period = static_cast<std::uint64_t>((now_ns - started_ns_) / entry.period_ns);
    if (period >= entry.next_period) {
      const std::uint64_t missed = period - entry.next_period;
      entry.cycle->run({.now_ns = clock_.now_ns(), .period_index = period}, missed);
      entry.next_period = period + 1;
    }
    next_ns = std::min(
        next_ns, started_ns_ + static_cast<std::int64_t>(entry.next_period) * entry.period_ns);
  }
  ticks_.fetch_add(1, std::memory_order_relaxed);
  return next_ns;
}

}  // namespace loopwarden::daemon::external
