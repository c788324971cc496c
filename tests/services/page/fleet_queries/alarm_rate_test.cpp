// SPDX-License-Identifier: Apache-2.0
#include "services/page/fleet_queries/alarm_rate.hpp"

#include <catch2/catch.hpp>

namespace loopwarden::tests::alarm_rate_test {

using namespace fleet;

TEST_CASE("rates of each group and of all groups, per day and week") {
  const std::int64_t until = 3'000'000;
  const std::int64_t newest = until - 1;
  const std::int64_t yesterday = newest - kBinsOfDay;
  const auto rates = alarm_rates(
      {{"A", newest, 11}, {"A", newest - 1, 10}, {"B", newest, 1}, {"B", yesterday, 144}}, until);
  REQUIRE(rates.size() == 3);
  const AlarmRate& a = rates.at("A");
  CHECK(a.day.raised == 21);
  CHECK(a.day.per_bin == Approx(21.0 / 144.0));
  CHECK(a.day.most == 11);
  CHECK(a.day.flood_percent == Approx(100.0 / 144.0));  // ten are no flood yet
  CHECK(a.week.flood_percent == Approx(100.0 / 1008.0));
  CHECK(a.bins.back() == 11);
  CHECK(a.bins[kBinsOfDay - 2] == 10);
  CHECK(a.bins.front() == 0);
  const AlarmRate& b = rates.at("B");
  CHECK(b.day.raised == 1);
  CHECK(b.week.raised == 145);
  CHECK(b.week.most == 144);
  CHECK(b.week.per_bin == Approx(145.0 / 1008.0));
  CHECK(rates.at("").day.raised == 22);
  CHECK(rates.at("").day.most == 12);
  CHECK(rates.at("").bins.back() == 12);
}

TEST_CASE("without an alarm all rates are 0, and alarms outside the week don't count") {
  const auto rates = alarm_rates({{"A", 1000 - kBinsOfWeek - 1, 5}, {"A", 1000, 5}}, 1000);
  REQUIRE(rates.size() == 1);
  CHECK(rates.at("").week.raised == 0);
  CHECK(rates.at("").day.flood_percent == 0.0);
}

}  // namespace loopwarden::tests::alarm_rate_test
