// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <type_traits>

namespace loopwarden::base {

// A ring buffer of fixed size from one writing thread to one reading thread. A full ring refuses
// the new item and counts it: the writer never waits. The behaviour is undefined if a side has more
// than one thread.
template <class T>
class SpscRing {
  static_assert(std::is_trivially_copyable_v<T>, "items are copied without locks");

 public:
  // Allocates room for at least `capacity` items (rounded up to a power of two). No other function
  // allocates. `first` is the start of both counters; they may wrap.
  explicit SpscRing(std::size_t capacity, std::size_t first = 0)
      : mask_(round_up(capacity) - 1),
        items_(new T[mask_ + 1]{}),
        head_(first),
        cached_tail_(first),
        tail_(first),
        cached_head_(first) {}

  // Writing thread only. If the ring is full, returns false and counts one more drop.
  bool try_push(const T& item) noexcept {
    const std::size_t head = head_.load(std::memory_order_relaxed);
    if (head - cached_tail_ > mask_) {
      cached_tail_ = tail_.load(std::memory_order_acquire);
      if (head - cached_tail_ > mask_) {
        dropped_.store(dropped_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
        return false;
      }
    }
    items_[head & mask_] = item;
    head_.store(head + 1, std::memory_order_release);
    return true;
  }

  // Writing thread only. Returns the number of items that are sure to be accepted.
  std::size_t room() const noexcept {
    const std::size_t used =
        head_.load(std::memory_order_relaxed) - tail_.load(std::memory_order_acquire);
    return mask_ + 1 - used;
  }

  // Reading thread only. Returns false if the ring is empty.
  bool try_pop(T& item) noexcept {
    const std::size_t tail = tail_.load(std::memory_order_relaxed);
    if (tail == cached_head_) {
      cached_head_ = head_.load(std::memory_order_acquire);
      if (tail == cached_head_) return false;
    }
    item = items_[tail & mask_];
    tail_.store(tail + 1, std::memory_order_release);
    return true;
  }

  // Any thread. Returns the number of items refused so far.
  std::uint64_t dropped() const noexcept { return dropped_.load(std::memory_order_relaxed); }
  std::size_t capacity() const noexcept { return mask_ + 1; }

 private:
  static std::size_t round_up(std::size_t capacity) noexcept {
    std::size_t size = 2;
    while (size < capacity) size *= 2;
    return size;
  }

  const std::size_t mask_;
  const std::unique_ptr<T[]> items_;
  alignas(64) std::atomic<std::size_t> head_;
  std::size_t cached_tail_;  // tail_ as the writer last read it
  std::atomic<std::uint64_t> dropped_{0};
  alignas(64) std::atomic<std::size_t> tail_;
  std::size_t cached_head_;  // head_ as the reader last read it
};

}  // namespace loopwarden::base
