// SPDX-License-Identifier: Apache-2.0
// Properties of the channels between threads, under any order of use.
#include <catch2/catch.hpp>
#include <cstdint>
#include <deque>
#include <limits>
#include <thread>
#include <vector>

#include "base/newest_value.hpp"
#include "base/spsc_ring.hpp"
#include "tests/support/property.hpp"

namespace channels_property_test {

using loopwarden::base::NewestValue;
using loopwarden::base::SpscRing;
using namespace loopwarden::tests::property;

TEST_CASE("a ring returns the accepted items in order, and counts the refused ones",
          "[os][ring][property]") {
  for_all("any order of pushing and popping", 500, [] {
    // In half of the tries the counters begin near their end, so that they wrap during the test.
    const std::size_t first = coin() ? 0 : std::numeric_limits<std::size_t>::max() - one_of(20);
    SpscRing<std::uint64_t> ring(static_cast<std::size_t>(integer(1, 40)), first);
    std::deque<std::uint64_t> expected;
    std::uint64_t next = 0;
    std::uint64_t refused = 0;
    const std::int64_t steps = integer(0, 400);
    const std::size_t pushes_in_ten = 3 + one_of(5);
    for (std::int64_t i = 0; i < steps; ++i) {
      if (one_of(10) < pushes_in_ten) {
        const bool room = expected.size() < ring.capacity();
        require(ring.try_push(next) == room, "an item is accepted only if there is room");
        if (room) expected.push_back(next);
        if (!room) ++refused;
        ++next;
      } else {
        std::uint64_t item = next;
        require(ring.try_pop(item) == !expected.empty(),
                "an item is returned only if one is stored");
        if (expected.empty()) {
          require(item == next, "the output keeps its value without an item");
        } else {
          require(item == expected.front(), "the oldest first");
          expected.pop_front();
        }
      }
      require(ring.dropped() == refused, "each refusal is counted");
      require(ring.room() == ring.capacity() - expected.size(), "room for the rest");
    }
  });
}

TEST_CASE("a latest-value buffer holds the newest value, under any order of use",
          "[os][newest_value][property]") {
  for_all("any order of publishing, fetching and looking", 500, [] {
    NewestValue<std::uint64_t> box(7);
    std::uint64_t newest = 7;
    bool fresh = false;
    const std::int64_t steps = integer(0, 300);
    for (std::int64_t i = 0; i < steps; ++i) {
      switch (one_of(3)) {
        case 0:
          newest = bits();
          fresh = true;
          box.publish(newest);
          break;
        case 1: {
          std::uint64_t value = ~newest;
          require(box.fetch(value) == fresh, "fetched once");
          require(value == (fresh ? newest : ~newest), "the newest, or left alone");
          fresh = false;
          break;
        }
        default: require(box.newest() == newest, "always in sight"); fresh = false;
      }
    }
  });
}

TEST_CASE("between two threads of any speed every item is returned or counted",
          "[os][ring][property]") {
  for_all("a writer and a reader", 20, [] {
    const auto items = static_cast<std::uint64_t>(integer(1, 3000));
    const auto write_burst = static_cast<std::uint64_t>(integer(1, 50));
    const auto read_burst = static_cast<std::uint64_t>(integer(1, 50));
    SpscRing<std::uint64_t> ring(static_cast<std::size_t>(integer(1, 64)));
    NewestValue<std::uint64_t> written(0);
    std::thread writer([&] {
      for (std::uint64_t i = 1; i <= items; ++i) {
        ring.try_push(i);
        written.publish(i);
        if (i % write_burst == 0) std::this_thread::yield();
      }
    });
    std::uint64_t last = 0;
    std::uint64_t given = 0;
    std::uint64_t newest = 0;
    bool in_order = true;
    for (bool done = false; !done;) {
      const std::uint64_t now = written.newest();
      in_order = in_order && now >= newest;
      newest = now;
      done = newest == items;
      std::uint64_t item = 0;
      // All items pushed before the last published value are visible by now.
      for (std::uint64_t k = 0; (done || k < read_burst) && ring.try_pop(item); ++k) {
        in_order = in_order && item > last;
        last = item;
        ++given;
      }
      if (!done) std::this_thread::yield();
    }
    writer.join();
    require(in_order, "neither channel goes back");
    require(given + ring.dropped() == items, "given or counted");
  });
}

}  // namespace channels_property_test
