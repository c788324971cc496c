// SPDX-License-Identifier: Apache-2.0
#include "base/spsc_ring.hpp"

#include <array>
#include <catch2/catch.hpp>
#include <cstdint>
#include <thread>

namespace spsc_ring_test {

using loopwarden::base::SpscRing;

TEST_CASE("a ring returns its items in order", "[os][ring]") {
  SpscRing<int> ring(8);
  int item = 0;
  CHECK_FALSE(ring.try_pop(item));
  for (int round = 0; round < 50; ++round) {  // wraps many times
    for (int i = 0; i < 5; ++i) REQUIRE(ring.try_push(10 * round + i));
    for (int i = 0; i < 5; ++i) {
      REQUIRE(ring.try_pop(item));
      REQUIRE(item == 10 * round + i);
    }
    REQUIRE_FALSE(ring.try_pop(item));
  }
  CHECK(ring.dropped() == 0);
}

TEST_CASE("the room is at least the requested one", "[os][ring]") {
  const std::size_t asked = GENERATE(1U, 2U, 3U, 8U, 9U, 1000U);
  SpscRing<int> ring(asked);
  CHECK(ring.capacity() >= asked);
  for (std::size_t i = 0; i < ring.capacity(); ++i) REQUIRE(ring.try_push(static_cast<int>(i)));
  CHECK_FALSE(ring.try_push(-1));
}

TEST_CASE("the writer can ask how many items are certain to be accepted", "[os][ring]") {
  SpscRing<int> ring(8);
  CHECK(ring.room() == 8);
  for (int i = 0; i < 8; ++i) {
    REQUIRE(ring.try_push(i));
    CHECK(ring.room() == static_cast<std::size_t>(7 - i));
  }
  int item = 0;
  REQUIRE(ring.try_pop(item));
  CHECK(ring.room() == 1);
}

TEST_CASE("a full ring refuses the new item, counts it and keeps the old", "[os][ring]") {
  SpscRing<int> ring(4);
  for (int i = 0; i < 4; ++i) REQUIRE(ring.try_push(i));
  CHECK_FALSE(ring.try_push(4));
  CHECK_FALSE(ring.try_push(5));
  CHECK(ring.dropped() == 2);
  int item = -1;
  REQUIRE(ring.try_pop(item));
  CHECK(item == 0);
  CHECK(ring.try_push(6));  // there is room again
  for (const int expected : {1, 2, 3, 6}) {
    REQUIRE(ring.try_pop(item));
    CHECK(item == expected);
  }
  CHECK(ring.dropped() == 2);
}

TEST_CASE("the counters of a ring may wrap", "[os][ring]") {
  SpscRing<int> ring(4, SIZE_MAX - 5);
  int item = 0;
  for (int round = 0; round < 10; ++round) {
    for (int i = 0; i < 4; ++i) REQUIRE(ring.try_push(10 * round + i));
    REQUIRE(ring.room() == 0);
    REQUIRE_FALSE(ring.try_push(-1));
    for (int i = 0; i < 4; ++i) {
      REQUIRE(ring.try_pop(item));
      REQUIRE(item == 10 * round + i);
    }
    REQUIRE_FALSE(ring.try_pop(item));
  }
}

TEST_CASE("between two threads no item is lost, doubled or torn, except refused ones",
          "[os][ring]") {
  struct Item {
    std::uint64_t number = 0;
    std::array<std::uint64_t, 4> copies{};
  };
  SpscRing<Item> ring(64);
  constexpr std::uint64_t kItems = 200'000;
  std::uint64_t refused = 0;
  std::thread writer([&] {
    for (std::uint64_t i = 1; i <= kItems; ++i) {
      const Item item{i, {i, i, i, i}};
      // Half of the items are retried. The others are lost if there is no room.
      bool pushed = ring.try_push(item);
      while (!pushed && i % 2 == 0) {
        ++refused;
        std::this_thread::yield();
        pushed = ring.try_push(item);
      }
      if (!pushed) ++refused;
    }
  });

  std::uint64_t last = 0;
  std::uint64_t even = 0;
  bool in_order = true;
  bool torn = false;
  Item item;
  while (last < kItems) {
    if (!ring.try_pop(item)) {
      std::this_thread::yield();
      continue;
    }
    in_order = in_order && item.number > last;
    for (const std::uint64_t copy : item.copies) torn = torn || copy != item.number;
    last = item.number;
    if (last % 2 == 0) ++even;
  }
  writer.join();
  CHECK(in_order);
  CHECK_FALSE(torn);
  CHECK(even == kItems / 2);
  CHECK(ring.dropped() == refused);
  CHECK_FALSE(ring.try_pop(item));
}

}  // namespace spsc_ring_test
