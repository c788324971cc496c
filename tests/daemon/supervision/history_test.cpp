// SPDX-License-Identifier: Apache-2.0
#include "daemon/supervision/history.hpp"

#include <catch2/catch.hpp>
#include <cmath>

namespace loopwarden::daemon::supervision::history_test {
namespace {

loopwarden::monitor::Cycle cycle(std::uint64_t index, bool automatic = true, bool good = true) {
  const auto v = static_cast<double>(index);
  return {.period_index = index,
          .sp = v + 0.1,
          .pv = v + 0.2,
          .co = v + 0.3,
          .automatic = automatic,
          .pv_good = good};
}

}  // namespace

TEST_CASE("the newest minutes are kept in their order, the oldest go", "[monitor][history]") {
  History history(1.0, 0.1);  // ten cycles
  for (std::uint64_t k = 100; k < 125; ++k) history.add(cycle(k));
  const History::Minutes minutes = history.minutes();
  CHECK(minutes.end == 125);
  CHECK(minutes.period_s == 0.1);
  REQUIRE(minutes.pv.size() == 10);
  CHECK(minutes.pv.front() == 115.2);
  CHECK(minutes.pv.back() == 124.2);
  CHECK(minutes.sp.back() == 124.1);
  CHECK(minutes.co.back() == 124.3);
  CHECK(history.newest() == 124);
}

TEST_CASE("missing cycles and bad PV are NaN; a long gap and manual begin anew",
          "[monitor][history]") {
  History history(100.0, 0.1);
  history.add(cycle(1));
  history.add(cycle(4));
  history.add(cycle(5, true, false));
  History::Minutes minutes = history.minutes();
  REQUIRE(minutes.pv.size() == 5);
  CHECK(std::isnan(minutes.pv[1]));
  CHECK(std::isnan(minutes.co[2]));
  CHECK(minutes.pv[3] == 4.2);
  CHECK(std::isnan(minutes.pv[4]));
  CHECK(minutes.co[4] == 5.3);

  history.add(cycle(200));  // 19 s later
  CHECK(history.minutes().pv.size() == 1);
  history.add(cycle(201, false));
  CHECK(history.minutes().pv.empty());
  history.add(cycle(202));
  minutes = history.minutes();
  REQUIRE(minutes.pv.size() == 1);
  CHECK(minutes.pv[0] == 202.2);
}

TEST_CASE("how long something has spoken against the twin", "[monitor][history]") {
  History history(100.0, 0.1);
  for (std::uint64_t k = 0; k < 50; ++k) {
    history.add(cycle(k));
    if (k < 20) history.quiet();
  }
  CHECK(history.unquiet_s() == Approx(3.0));
  history.quiet();
  CHECK(history.unquiet_s() == 0.0);
  // Never quiet: not longer than what there is.
  History other(100.0, 0.1);
  for (std::uint64_t k = 1000; k < 1010; ++k) other.add(cycle(k));
  CHECK(other.unquiet_s() <= 1.0);
}

}  // namespace loopwarden::daemon::supervision::history_test
