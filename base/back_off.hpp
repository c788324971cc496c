// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>

namespace loopwarden::base {

// Computes the wait before the next attempt: it doubles, with a random part. A thousand boxes whose
// server returns then do not all connect at the same time.
struct BackOff {
  std::chrono::milliseconds first{1000};
  std::chrono::milliseconds longest{60'000};

  // Returns the pause after attempt `attempts` (from 1 on) has failed. It is between half and all
  // of first, 2 first, 4 first ... longest, chosen by `chance` from 0 to 1.
  std::chrono::milliseconds pause(std::int64_t attempts, double chance) const noexcept {
    std::int64_t whole = first.count();
    for (std::int64_t i = 1; i < attempts && whole < longest.count(); ++i) whole *= 2;
    whole = std::min<std::int64_t>(whole, longest.count());
    return std::chrono::milliseconds(
        whole / 2 + static_cast<std::int64_t>(chance * static_cast<double>(whole - whole / 2)));
  }
};

}  // namespace loopwarden::base
