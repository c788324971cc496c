// SPDX-License-Identifier: Apache-2.0
#include "net/http/lanes.hpp"

#include <catch2/catch.hpp>

#include <future>

namespace loopwarden::tests::lanes_test {

using namespace http;

TEST_CASE("a lane that is full says so, and no client has all of it") {
  std::promise<void> go;
  const std::shared_future<void> open = go.get_future().share();
  std::promise<void> begun;
  Lanes lanes({{{"t", 0, 0}, {"t", 1, 4}, {"t", 1, 4}, {"t", 1, 4}, {"t", 1, 4}, {"t", 1, 4}}});
  REQUIRE(lanes.begin(Lane::disk, "a", [&] {
    begun.set_value();
    open.wait();
  }));
  begun.get_future().wait();
  CHECK(lanes.begin(Lane::disk, "a", [] {}));
  CHECK(lanes.begin(Lane::disk, "a", [] {}));
  CHECK_FALSE(lanes.begin(Lane::disk, "a", [] {}));
  CHECK(lanes.begin(Lane::disk, "b", [] {}));
  CHECK(lanes.begin(Lane::disk, "c", [] {}));
  CHECK_FALSE(lanes.begin(Lane::disk, "d", [] {}));
  std::promise<void> other;
  CHECK(lanes.begin(Lane::daemon, "a", [&] { other.set_value(); }));
  other.get_future().wait();  // while the disk's lane stands
  go.set_value();
}

}  // namespace loopwarden::tests::lanes_test
