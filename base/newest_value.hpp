// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <type_traits>

namespace loopwarden::base {

// Hands the newest value from one writing thread to one reading thread.
//
// Triple buffer: the writer fills its own slot and swaps it with the shared slot. The reader swaps
// the shared slot with its own if the shared one is newer. Both sides are wait-free. Values that
// the reader did not fetch in time are overwritten, never torn. The behaviour is undefined if a
// side has more than one thread.
template <class T>
class NewestValue {
  static_assert(std::is_trivially_copyable_v<T>, "slots are copied without locks");

 public:
  explicit NewestValue(const T& initial = T{}) noexcept { slots_.fill({initial}); }

  // Writing thread only.
  void publish(const T& value) noexcept {
    slots_[writer_slot_].value = value;
    const auto previous = shared_.exchange(static_cast<std::uint8_t>(writer_slot_ | kFresh),
                                           std::memory_order_acq_rel);
    writer_slot_ = previous & kSlotMask;
  }

  // Reading thread only. Replaces `value` and returns true if there is a value not fetched before.
  bool fetch(T& value) noexcept {
    if (!refresh()) return false;
    value = slots_[reader_slot_].value;
    return true;
  }

  // Reading thread only. The reference stays valid until the next call.
  const T& newest() noexcept {
    refresh();
    return slots_[reader_slot_].value;
  }

 private:
  static constexpr std::uint8_t kFresh = 0x80;
  static constexpr std::uint8_t kSlotMask = 0x03;

  bool refresh() noexcept {
    if ((shared_.load(std::memory_order_relaxed) & kFresh) == 0) return false;
    const auto previous = shared_.exchange(reader_slot_, std::memory_order_acq_rel);
    reader_slot_ = previous & kSlotMask;
    return true;
  }

  // Each slot has its own cache line, so that writer and reader don't slow each other down.
  struct alignas(64) Slot {
    T value;
  };
  std::array<Slot, 3> slots_;
  alignas(64) std::atomic<std::uint8_t> shared_{2};
  alignas(64) std::uint8_t writer_slot_ = 0;
  alignas(64) std::uint8_t reader_slot_ = 1;
};

}  // namespace loopwarden::base
