// SPDX-License-Identifier: Apache-2.0
#include "daemon/rt/cyclic_runner.hpp"

#include <algorithm>
#include <bit>

namespace loopwarden::daemon::rt {

void LatencyHistogram::add(std::int64_t nanoseconds) noexcept {
  const auto microseconds =
      static_cast<std::uint64_t>(std::max<std::int64_t>(nanoseconds, 0) / 1000);
  const auto bin = static_cast<std::size_t>(std::bit_width(microseconds | 1U) - 1);
  ++bins[std::min(bin, kBins - 1)];
  worst_ns = std::max(worst_ns, nanoseconds);
  sum_ns += std::max<std::int64_t>(nanoseconds, 0);
}

std::int64_t LatencyHistogram::quantile_ns(double share) const noexcept {
  std::uint64_t total = 0;
  for (const std::uint64_t count : bins) total += count;
  std::uint64_t below = 0;
  for (std::size_t i = 0; i < kBins; ++i) {
    below += bins[i];
    if (static_cast<double>(below) >= share * static_cast<double>(total)) {
      return std::min(worst_ns, (std::int64_t{2000} << i));
    }
  }
  return worst_ns;
}

void CyclicRunner::add(ControlCycle& cycle, std::uint64_t every) {
  // Loops with the same period get different phases, so that no tick runs all of them.
  const auto same = static_cast<std::uint64_t>(std::count_if(
      entries_.begin(), entries_.end(), [&](const Entry& e) { return e.every == every; }));
  entries_.push_back({&cycle, every, same % every, 0});
}

void CyclicRunner::run_tick(std::uint64_t tick, std::int64_t now_ns, bool stop) noexcept {
  for (Entry& entry : entries_) {
    if (tick < entry.phase) continue;
    const std::uint64_t period = (tick - entry.phase) / entry.every;
    if (period < entry.next_period) continue;
    const std::uint64_t missed = period - entry.next_period;
    entry.next_period = period + 1;
    entry.cycle->run({.now_ns = now_ns, .period_index = period}, missed, stop);
  }
}

void CyclicRunner::run(const std::atomic<bool>& stop, const std::atomic<bool>& quit) noexcept {
  const std::int64_t start_ns = clock_.now_ns() + tick_ns_;
  for (std::uint64_t tick = 0; !quit.load(std::memory_order_relaxed); ++tick) {
    std::int64_t deadline_ns = start_ns + static_cast<std::int64_t>(tick) * tick_ns_;
    clock_.sleep_until_ns(deadline_ns);
    const std::int64_t woke_ns = clock_.now_ns();

    const std::int64_t late_ns = woke_ns - deadline_ns;
    if (late_ns >= tick_ns_) {
      const auto skipped = static_cast<std::uint64_t>(late_ns / tick_ns_);
      tick += skipped;
      ++status_.overruns;
      status_.skipped_ticks += skipped;
    }
    run_tick(tick, woke_ns, stop.load(std::memory_order_relaxed));

    status_.wake_up.add(late_ns);
    status_.work.add(clock_.now_ns() - woke_ns);
    ++status_.ticks;
    published_.publish(status_);
    progress_.store(status_.ticks, std::memory_order_relaxed);
  }
}

}  // namespace loopwarden::daemon::rt
