// SPDX-License-Identifier: Apache-2.0
// The loops on the real-time thread: their backends, channels and cycles, and the runner that paces
// them.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "base/clock.hpp"
#include "base/spsc_ring.hpp"
#include "base/thread.hpp"
#include "config/loop_config.hpp"
#include "daemon/app/backend_factory.hpp"
#include "daemon/loops/loop_runtime.hpp"
#include "daemon/rt/cyclic_runner.hpp"

namespace loopwarden::daemon {

class RealTimeLoops {
 public:
  RealTimeLoops() = default;
  RealTimeLoops(const RealTimeLoops&) = delete;
  RealTimeLoops& operator=(const RealTimeLoops&) = delete;
  ~RealTimeLoops() { end(); }

  // Locks the process's memory. Call it before anything large is allocated.
  void lock_memory();
  // Makes the loops that are controlled here, with room for the watched loops after them. `start`
  // returns how a loop starts. Throws std::runtime_error if a backend can't work.
  using Starts = std::function<rt::StartSettings(const config::LoopConfig&)>;
  void make(const config::Configuration& configuration, const Starts& start);
  void start(const config::RealTime& rights);
  // Moves the outputs to their stop actions, within their rate limits.
  void stop() noexcept { stop_ = true; }
  bool all_stopped() const noexcept;
  // Ends the thread.
  void end() noexcept;

  // Empty before make().
  std::vector<LoopRuntime>& all() noexcept { return loops_; }
  const std::vector<LoopRuntime>& all() const noexcept { return loops_; }
  BackendFactory& backends() noexcept { return backends_; }
  base::Clock& clock() noexcept { return clock_; }
  std::uint64_t ticks() const noexcept { return runner_->ticks(); }

  // Main thread: returns the next event of the cycles.
  bool next_event(rt::Event& event) noexcept { return events_.try_pop(event); }
  rt::RunnerStatus publish_status();

  // Returns the runner's status. From any thread.
  rt::RunnerStatus status() const;
  // Returns the refused real-time rights in words; empty: all were granted.
  std::string rights_missing() const;
  std::uint64_t events_dropped() const noexcept { return events_.dropped(); }

 private:
  BackendFactory backends_;
  std::vector<LoopRuntime> loops_;
  base::SpscRing<rt::Event> events_{4096};
  base::MonotonicClock clock_;
  std::unique_ptr<rt::CyclicRunner> runner_;
  std::atomic<bool> stop_{false};
  std::atomic<bool> quit_{false};
  base::Thread thread_;
  mutable std::mutex status_mutex_;  // guards data that the sockets' threads read
  rt::RunnerStatus status_;
  std::string rights_missing_;
};

// Returns a loop's period in ns of real time.
std::int64_t period_ns(const config::LoopConfig& loop, double accelerate);
// Returns how far readers of a loop's channels may lag.
rt::LoopChannels::Room room_of(const config::LoopConfig& loop,
                               const config::Configuration& configuration);
// Returns the number of cycles for which a request of planned moves is valid.
std::uint32_t moves_lease(const config::LoopConfig& loop, double accelerate);

}  // namespace loopwarden::daemon
