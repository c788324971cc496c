// SPDX-License-Identifier: Apache-2.0
#include "base/newest_value.hpp"

#include <array>
#include <atomic>
#include <catch2/catch.hpp>
#include <cstdint>
#include <thread>

namespace newest_value_test {

using loopwarden::base::NewestValue;

TEST_CASE("before the first value is published the buffer holds its initial value",
          "[os][newest_value]") {
  NewestValue<int> box(7);
  int value = 0;
  CHECK_FALSE(box.fetch(value));
  CHECK(value == 0);
  CHECK(box.newest() == 7);
}

TEST_CASE("a value is fetched once and stays in the buffer", "[os][newest_value]") {
  NewestValue<int> box;
  box.publish(1);
  int value = 0;
  CHECK(box.fetch(value));
  CHECK(value == 1);
  value = 0;
  CHECK_FALSE(box.fetch(value));
  CHECK(value == 0);
  CHECK(box.newest() == 1);
}

TEST_CASE("values that were not fetched are overwritten by the newest", "[os][newest_value]") {
  NewestValue<int> box;
  for (int i = 1; i <= 5; ++i) box.publish(i);
  int value = 0;
  CHECK(box.fetch(value));
  CHECK(value == 5);
  CHECK_FALSE(box.fetch(value));

  SECTION("in every order of publishing and fetching") {
    int published = 5;
    std::uint32_t pattern = 0x9e3779b9U;
    for (int i = 0; i < 10'000; ++i) {
      pattern = pattern * 1664525U + 1013904223U;
      const bool publish = (pattern >> 16U & 1U) != 0U;
      if (publish) box.publish(++published);
      if ((pattern >> 17U & 1U) != 0U) {
        box.fetch(value);
        REQUIRE(value == published);
      }
    }
  }
}

TEST_CASE("newest() returns a value published since", "[os][newest_value]") {
  NewestValue<int> box(3);
  const int& first = box.newest();
  CHECK(first == 3);
  box.publish(4);
  CHECK(first == 3);  // unchanged until the next call
  CHECK(box.newest() == 4);
}

TEST_CASE("between two threads no value is torn, lost for ever or older than one seen",
          "[os][newest_value]") {
  struct Block {
    std::array<std::uint64_t, 12> words{};  // more than a cache line
  };
  NewestValue<Block> box;
  constexpr std::uint64_t kValues = 200'000;
  std::atomic<bool> done{false};
  std::thread writer([&] {
    Block block;
    for (std::uint64_t i = 1; i <= kValues; ++i) {
      block.words.fill(i);
      box.publish(block);
    }
    done.store(true);
  });

  std::uint64_t last = 0;
  bool torn = false;
  bool went_back = false;
  bool fresh_lies = false;
  Block block;
  while (true) {
    // before the fetch, which must return any value published until then
    const bool ended = done.load();
    const bool fresh = box.fetch(block);
    for (const std::uint64_t word : block.words) torn = torn || word != block.words[0];
    went_back = went_back || block.words[0] < last;
    fresh_lies = fresh_lies || fresh != (block.words[0] > last);
    last = block.words[0];
    if (ended) break;
  }
  writer.join();
  CHECK_FALSE(torn);
  CHECK_FALSE(went_back);
  CHECK_FALSE(fresh_lies);
  CHECK(last == kValues);
}

}  // namespace newest_value_test
