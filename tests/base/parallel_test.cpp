// SPDX-License-Identifier: Apache-2.0
#include "base/parallel.hpp"

#include <algorithm>
#include <atomic>
#include <catch2/catch.hpp>
#include <cstddef>
#include <stdexcept>
#include <vector>

namespace parallel_test {

using namespace loopwarden::base;

TEST_CASE("every index is processed once, with any number of threads", "[workbench]") {
  const unsigned threads = GENERATE(0U, 1U, 2U, 7U);
  std::vector<int> visits(100, 0);
  std::vector<std::size_t> progress;
  parallel_for(
      visits.size(), threads, [&](std::size_t i) { ++visits[i]; },
      [&](std::size_t done) { progress.push_back(done); });
  CHECK(std::count(visits.begin(), visits.end(), 1) == 100);
  REQUIRE(progress.size() == 100);
  CHECK(std::is_sorted(progress.begin(), progress.end()));
  CHECK(progress.back() == 100);
}

TEST_CASE("no work is no error", "[workbench]") {
  CHECK_NOTHROW(parallel_for(0, 4, [](std::size_t) { throw std::runtime_error("called"); }));
}

TEST_CASE("an exception ends the work and is rethrown", "[workbench]") {
  const unsigned threads = GENERATE(1U, 2U);
  std::atomic<int> calls{0};
  const auto body = [&](std::size_t i) {
    ++calls;
    if (i == 3) throw std::runtime_error("three");
  };
  CHECK_THROWS_WITH(parallel_for(100000, threads, body), "three");
  CHECK(calls < 100000);
}

}  // namespace parallel_test
