// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/thread.hpp"
#include "daemon/supervision/alarm_registry.hpp"

namespace loopwarden::daemon::supervision {

struct MonitorStatus {
  std::uint64_t windows = 0;  // full ones
  std::uint64_t cycles = 0;   // taken from the rings
  std::uint64_t dropped = 0;  // lost, because a ring was full
  std::size_t backlog = 0;    // loops with more cycles after the last round
};

// The thread that steps the supervisors of all loops in turn.
//
// In one turn a loop steps at most LoopSupervisor::kCyclesATurn cycles and judges at most one
// window, so that a loop with a long queue does not delay the others. Each round begins one loop
// later than the round before. A cycle that is lost because a ring is full interrupts the window of
// its loop.
class Monitor {
 public:
  // `registry` outlives this and has the loops in the same order.
  Monitor(const std::vector<MonitoredLoop>& loops, AlarmRegistry& registry,
          const Raised& raised = {});
  Monitor(const Monitor&) = delete;
  Monitor& operator=(const Monitor&) = delete;
  ~Monitor() { stop(); }

  void start();
  void stop();

  // Takes one turn for every loop; public for tests.
  void round();

  MonitorStatus status() const noexcept;  // any thread
  // Null if the loop has no twin. Any thread.
  const History* history(std::size_t loop) const noexcept {
    return registry_.supervisor(loop).history();
  }
  std::uint64_t ticks() const noexcept { return ticks_.load(std::memory_order_relaxed); }

 private:
  AlarmRegistry& registry_;
  std::size_t loops_;
  std::size_t first_ = 0;  // loop at which the next round begins
  std::atomic<std::uint64_t> windows_{0};
  std::atomic<std::uint64_t> cycles_{0};
  std::atomic<std::size_t> backlog_{0};
  std::atomic<bool> quit_{false};
  std::atomic<std::uint64_t> ticks_{0};
  base::Thread thread_;
};

}  // namespace loopwarden::daemon::supervision
