// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>

namespace loopwarden::base {

// Measures how long a thread has been waiting for the disk. Other threads read it, because a thread
// that hangs can't report it.
class DiskWait {
 public:
  // A disk that takes longer counts as hung. Slow disks answer sooner.
  static constexpr double kHung = 1.0;  // s

  // Put around calls that may wait for the disk.
  class Section {
   public:
    explicit Section(DiskWait& wait) noexcept : wait_(wait) { wait_.since_ns_ = now_ns(); }
    Section(const Section&) = delete;
    Section& operator=(const Section&) = delete;
    ~Section() { wait_.since_ns_ = kNone; }

   private:
    DiskWait& wait_;
  };

  // Returns s; 0: the thread does not wait. Any thread.
  double seconds() const noexcept {
    const std::int64_t since_ns = since_ns_.load(std::memory_order_relaxed);
    return since_ns == kNone ? 0.0 : static_cast<double>(now_ns() - since_ns) / 1e9;
  }
  bool hung() const noexcept { return seconds() > kHung; }

 private:
  static constexpr std::int64_t kNone = -1;
  static std::int64_t now_ns() noexcept {
    return std::chrono::duration_cast<std::chrono::nanoseconds>(
               std::chrono::steady_clock::now().time_since_epoch())
        .count();
  }
  std::atomic<std::int64_t> since_ns_{kNone};
};

}  // namespace loopwarden::base
