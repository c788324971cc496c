// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>

namespace loopwarden::notify {

struct BackOff {
  std::int64_t first_ms = 2'000;
  std::int64_t longest_ms = 15LL * 60 * 1000;
  std::int64_t give_up_ms = 24LL * 3600 * 1000;  // after the message was made

  // The pause after the `attempts`th attempt has failed. It doubles each time; between half and all of it is taken, by
  // `chance` from 0 to 1, so that boxes that failed together don't come back together.
  std::int64_t pause_ms(std::int64_t attempts, double chance) const noexcept {
    std::int64_t whole = first_ms;
    for (std::int64_t i = 1; i < attempts && whole < longest_ms; ++i) whole *= 2;
    whole = std::min(whole, longest_ms);
    return whole / 2 + static_cast<std::int64_t>(chance * static_cast<double>(whole - whole / 2));
  }
};

}  // namespace loopwarden::notify
