// SPDX-License-Identifier: Apache-2.0
#include "net/mqtt/back_off.hpp"

#include <algorithm>

namespace loopwarden::mqtt {

BackOff::BackOff(std::chrono::milliseconds shortest, std::chrono::milliseconds longest,
                 std::uint32_t seed)
    : shortest_(shortest), longest_(longest), upper_(shortest), random_(seed) {}

std::chrono::milliseconds BackOff::next() {
  std::uniform_int_distribution<std::int64_t> wait(upper_.count() / 2, upper_.count());
  const std::chrono::milliseconds drawn(wait(random_));
  upper_ = std::min(2 * upper_, longest_);
  return drawn;
}

}  // namespace loopwarden::mqtt
