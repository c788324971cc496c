// SPDX-License-Identifier: Apache-2.0
#include "services/page/fleet_queries/answer_cache.hpp"

#include <catch2/catch.hpp>
#include <atomic>
#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "services/page/fleet/fleet.hpp"

namespace loopwarden::tests::answer_cache_test {

using namespace fleet;
using namespace std::chrono_literals;

struct Rig {
  AnswerCache::Clock::time_point now{};
  AnswerCache cache{{.fresh = 5s, .retry_after = 2s, .most = 2}, [this] { return now; }};
  int made = 0;

  std::string get(const std::string& key) {
    return *cache.get(
        key, [&] { return std::make_shared<const std::string>(key + std::to_string(++made)); });
  }
  std::string why(const std::string& key, const std::string& what) {
    try {
      cache.get(key, [&]() -> AnswerCache::Answer {
        ++made;
        throw FleetDown(what);
      });
    } catch (const FleetDown& e) {
      return e.what();
    }
    return "";
  }
};

TEST_CASE("a fresh answer is made once for all callers") {
  Rig rig;
  CHECK(rig.get("a") == "a1");
  rig.now += 4999ms;
  CHECK(rig.get("a") == "a1");
  CHECK(rig.get("b") == "b2");
  rig.now += 1ms;
  CHECK(rig.get("a") == "a3");
}

TEST_CASE("after a failure no key is retried for a while, but fresh answers are returned") {
  Rig rig;
  rig.get("a");
  rig.now += 3s;
  CHECK(rig.why("b", "gone") == "gone");
  CHECK(rig.made == 2);
  CHECK(rig.get("a") == "a1");
  CHECK(rig.why("c", "other") == "gone");
  CHECK(rig.made == 2);
  rig.now += 2s;
  CHECK(rig.get("b") == "b3");
  CHECK(rig.get("c") == "c4");
}

TEST_CASE("the newest answer is kept after a failure") {
  Rig rig;
  rig.get("a");
  rig.now += 1min;
  CHECK(rig.why("a", "gone") == "gone");
  CHECK(*rig.cache.last("a") == "a1");
  CHECK(rig.cache.last("b") == nullptr);
}

TEST_CASE("the oldest answer is dropped first") {
  Rig rig;
  for (const char* key : {"a", "b", "c"}) {
    rig.get(key);
    rig.now += 1ms;
  }
  CHECK(rig.cache.last("a") == nullptr);
  CHECK(rig.cache.last("b") != nullptr);
}

TEST_CASE("many simultaneous callers wait for one answer") {
  AnswerCache cache;
  std::atomic<int> made{0};
  std::vector<std::thread> askers;
  for (int i = 0; i < 16; ++i) {
    askers.emplace_back([&] {
      cache.get("a", [&] {
        ++made;
        std::this_thread::sleep_for(20ms);
        return std::make_shared<const std::string>("x");
      });
    });
  }
  for (std::thread& asker : askers) asker.join();
  CHECK(made == 1);
}

}  // namespace loopwarden::tests::answer_cache_test
