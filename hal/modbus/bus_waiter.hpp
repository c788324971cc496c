// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>

namespace loopwarden::hal::modbus {

// All waiting of a bus thread. It waits in short slices that keep ticks() growing, for the health
// check. Another thread can interrupt it at once.
class BusWaiter {
 public:
  enum class Result : std::uint8_t { deadline, ready, interrupted };

  BusWaiter();  // throws std::system_error if there is no file descriptor left
  BusWaiter(const BusWaiter&) = delete;
  BusWaiter& operator=(const BusWaiter&) = delete;
  ~BusWaiter();

  // Any thread.
  void interrupt() noexcept;
  void stop() noexcept;
  bool stopping() const noexcept { return stopping_.load(std::memory_order_acquire); }
  std::uint64_t ticks() const noexcept { return ticks_.load(std::memory_order_relaxed); }

  // Bus thread only. CLOCK_MONOTONIC.
  static std::int64_t now_ns() noexcept;
  Result wait_until(std::int64_t deadline_ns) noexcept { return wait_for_file(-1, 0, deadline_ns); }
  // Continues after an interruption. Returns false if it was ended by stop().
  bool sleep_until(std::int64_t deadline_ns) noexcept;
  // Returns `ready` once poll() reports one of `events`, an error or a hang-up of the file.
  // Continues after an interruption unless it was stop().
  Result wait_ready(int file, short events, std::int64_t deadline_ns) noexcept;

 private:
  Result wait_for_file(int file, short events, std::int64_t deadline_ns) noexcept;
  void tick() noexcept {
    ticks_.store(ticks_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  }

  int event_ = -1;
  std::atomic<bool> stopping_{false};
  std::atomic<std::uint64_t> ticks_{0};
};

}  // namespace loopwarden::hal::modbus
