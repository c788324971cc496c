// SPDX-License-Identifier: Apache-2.0
#include "base/back_off.hpp"

#include <catch2/catch.hpp>
#include <chrono>

namespace back_off_test {

using loopwarden::base::BackOff;
using namespace std::chrono_literals;

TEST_CASE("pauses double up to the longest, with jitter from half to all of it", "[back_off]") {
  constexpr BackOff kBackOff{.first = 1s, .longest = 10s};
  CHECK(kBackOff.pause(1, 0.0) == 500ms);
  CHECK(kBackOff.pause(1, 1.0) == 1s);
  CHECK(kBackOff.pause(3, 0.5) == 3s);
  CHECK(kBackOff.pause(1000, 1.0) == 10s);
  CHECK(kBackOff.pause(1'000'000'000'000, 0.0) == 5s);
}

}  // namespace back_off_test
