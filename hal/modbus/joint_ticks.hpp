// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>

namespace loopwarden::hal::modbus {

// A number that increases when each of several bus threads has made progress. Any thread.
class JointTicks {
 public:
  static constexpr std::size_t kMost = 5;

  // `ticks`: of at most kMost threads, in the same order each time.
  std::uint64_t of(std::span<const std::uint64_t> ticks) const noexcept {
    for (std::size_t i = 0; i < ticks.size(); ++i) {
      if (ticks[i] == seen_[i].load(std::memory_order_relaxed)) {
        return moves_.load(std::memory_order_relaxed);
      }
    }
    for (std::size_t i = 0; i < ticks.size(); ++i) {
      seen_[i].store(ticks[i], std::memory_order_relaxed);
    }
    return moves_.fetch_add(1, std::memory_order_relaxed) + 1;
  }

 private:
  mutable std::array<std::atomic<std::uint64_t>, kMost> seen_{};
  mutable std::atomic<std::uint64_t> moves_{0};
};

}  // namespace loopwarden::hal::modbus
