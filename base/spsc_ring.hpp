// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <type_traits>

namespace loopwarden::base {

// Fixed-size ring from one writing thread to one reading thread. A full ring refuses the new item
// and counts it: the writer never waits. With more than one thread on a side the behaviour is
// undefined.
template <class T>
class SpscRing {
  static_assert(std::is_trivially_copyable_v<T>, "items are copied without locks");

 public:
  // Room for at least `capacity` items (rounded up to a power of two). Allocates, here only.
  // `first` is where both counters begin; they may wrap.
  explicit SpscRing(std::size_t capacity, std::size_t first = 0)
      : mask_(round_up(capacity) - 1),
        items_(new T[mask_ + 1]{}),
        head_(first),
        cached_tail_(first),
        tail_(first),
        cached_head_(first) {}

  // Writing thread only. False, and one more drop, if the ring is full.
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

  // Writing thread only: so many items are sure to be taken.
  std::size_t room() const noexcept {
    const std::size_t used =
        head_.load(std::memory_order_relaxed) - tail_.load(std::memory_order_acquire);
    return mask_ + 1 - used;
  }

  // Reading thread only. False if there is nothing to read.
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

  // Any thread: items refused so far.
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
  std::size_t cached_tail_;  // writer's last look at tail_
  std::atomic<std::uint64_t> dropped_{0};
  alignas(64) std::atomic<std::size_t> tail_;
  std::size_t cached_head_;  // reader's last look at head_
};

}  // namespace loopwarden::base
