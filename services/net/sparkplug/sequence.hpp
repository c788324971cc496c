// SPDX-License-Identifier: Apache-2.0
// The two counters of Sparkplug B, both from 0 to 255 and then 0 again.
#pragma once

#include <cstdint>

namespace loopwarden::sparkplug {

// seq: of each message of an edge node, 0 in its NBIRTH. NDEATH has none.
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

// bdSeq: joins a connection's will with the births sent on it. It must outlive the program, so that the death of an
// older connection is never taken for one of the newest.
constexpr std::uint8_t bd_seq_after(std::uint8_t previous) noexcept {
  return static_cast<std::uint8_t>(previous + 1);
}

}  // namespace loopwarden::sparkplug
