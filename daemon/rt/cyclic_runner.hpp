// SPDX-License-Identifier: Apache-2.0
// Runs all loops on one thread at absolute deadlines.
//
// The tick is the greatest common divisor of the periods. Each loop runs once per period, in the
// order in which the loops were added. Loops with the same period are spread over the ticks. After
// an overrun the phase stays the same: whole ticks are skipped and counted, and each loop receives
// the number of periods that it missed.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "daemon/rt/control_cycle.hpp"
#include "base/clock.hpp"
#include "base/newest_value.hpp"

namespace loopwarden::daemon::rt {

// Histogram of durations in powers of two: bin i counts [2^i, 2^(i+1)) us, bin 0 also shorter ones.
struct LatencyHistogram {
  static constexpr std::size_t kBins = 18;  // up to 131 ms and beyond
  std::array<std::uint64_t, kBins> bins{};
  std::int64_t worst_ns = 0;
  std::int64_t sum_ns = 0;

  void add(std::int64_t nanoseconds) noexcept;
  // Returns the upper edge of the bin at which the counts reach `share`, ns; at most worst_ns.
  std::int64_t quantile_ns(double share) const noexcept;
};

struct RunnerStatus {
  std::uint64_t ticks = 0;
  std::uint64_t overruns = 0;  // ticks that began at least one tick late
  std::uint64_t skipped_ticks = 0;
  LatencyHistogram wake_up;  // from deadline to first instruction
  LatencyHistogram work;     // from first to last instruction, all loops of a tick
};

class CyclicRunner {
 public:
  // `tick_ns` > 0.
  CyclicRunner(base::Clock& clock, std::int64_t tick_ns) : clock_(clock), tick_ns_(tick_ns) {}

  // Adds a loop before the start. `every`: period of the loop in ticks, >= 1.
  void add(ControlCycle& cycle, std::uint64_t every);

  // Runs on the real-time thread until `quit`; passes `stop` to every cycle.
  void run(const std::atomic<bool>& stop, const std::atomic<bool>& quit) noexcept;

  // Status thread only.
  RunnerStatus status() noexcept { return published_.newest(); }
  // Number of ticks so far. Any thread.
  std::uint64_t ticks() const noexcept { return progress_.load(std::memory_order_relaxed); }

 private:
  struct Entry {
    ControlCycle* cycle;
    std::uint64_t every;
    std::uint64_t phase;
    std::uint64_t next_period;  // index of the period that runs next
  };
  void run_tick(std::uint64_t tick, std::int64_t now_ns, bool stop) noexcept;

  base::Clock& clock_;
  std::int64_t tick_ns_;
  std::vector<Entry> entries_;
  RunnerStatus status_;
  base::NewestValue<RunnerStatus> published_;
  std::atomic<std::uint64_t> progress_{0};
};

}  // namespace loopwarden::daemon::rt
