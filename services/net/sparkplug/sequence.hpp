// SPDX-License-Identifier: Apache-2.0
// The two counters of Sparkplug B. Both count from 0 to 255 and then restart at 0.
#pragma once

#include <cstdint>

namespace loopwarden::sparkplug {

// seq: number of each message of an edge node, 0 in its NBIRTH. NDEATH has none.
class Sequence {
 public:
  std::uint8_t restart() noexcept {
    next_ = 1;
    return 0;
  }
  std::uint8_t next() noexcept { return next_++; }

 private:
  std::uint8_t next_ = 0;
};

// Returns the next bdSeq, which links a connection's will with its births. Store it across
// restarts, so that the death of an older connection is never taken for one of the newest.
constexpr std::uint8_t bd_seq_after(std::uint8_t previous) noexcept {
  return static_cast<std::uint8_t>(previous + 1);
}

}  // namespace loopwarden::sparkplug
