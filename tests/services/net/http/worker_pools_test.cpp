// SPDX-License-Identifier: Apache-2.0
#include "services/net/http/worker_pools.hpp"

#include <catch2/catch.hpp>

#include <future>

namespace loopwarden::tests::worker_pools_test {

using namespace http;

TEST_CASE("a full pool refuses work, and one client can't take all of it") {
  std::promise<void> go;
  const std::shared_future<void> open = go.get_future().share();
  std::promise<void> begun;
  WorkerPools pools(
      {{{"t", 0, 0}, {"t", 1, 4}, {"t", 1, 4}, {"t", 1, 4}, {"t", 1, 4}, {"t", 1, 4}}});
  REQUIRE(pools.begin(Pool::disk, "a", [&] {
    begun.set_value();
    open.wait();
  }));
  begun.get_future().wait();
  CHECK(pools.begin(Pool::disk, "a", [] {}));
  CHECK(pools.begin(Pool::disk, "a", [] {}));
  CHECK_FALSE(pools.begin(Pool::disk, "a", [] {}));
  CHECK(pools.begin(Pool::disk, "b", [] {}));
  CHECK(pools.begin(Pool::disk, "c", [] {}));
  CHECK_FALSE(pools.begin(Pool::disk, "d", [] {}));
  std::promise<void> other;
  CHECK(pools.begin(Pool::daemon, "a", [&] { other.set_value(); }));
  other.get_future().wait();  // while the disk's pool is blocked
  go.set_value();
}

}  // namespace loopwarden::tests::worker_pools_test
