// SPDX-License-Identifier: Apache-2.0
// How long to wait before the next attempt: doubling, with a random part, so that a thousand boxes whose broker comes
// back don't all come at once.
#pragma once

#include <chrono>
#include <cstdint>
#include <random>

namespace loopwarden::mqtt {

class BackOff {
 public:
  // Waits lie between 50 and 100 % of shortest, 2 shortest, 4 shortest ... longest.
  BackOff(std::chrono::milliseconds shortest, std::chrono::milliseconds longest,
          std::uint32_t seed = std::random_device{}());

  std::chrono::milliseconds next();
  void reset() noexcept { upper_ = shortest_; }
  std::chrono::milliseconds longest() const noexcept { return longest_; }

 private:
  std::chrono::milliseconds shortest_;
  std::chrono::milliseconds longest_;
  std::chrono::milliseconds upper_;
  std::minstd_rand random_;
};

}  // namespace loopwarden::mqtt
