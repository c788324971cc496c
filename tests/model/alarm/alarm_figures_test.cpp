// SPDX-License-Identifier: Apache-2.0
#include "model/alarm/alarm_figures.hpp"

#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "model/alarm/limits.hpp"
#include "tests/support/property.hpp"

namespace alarm_figures_test {

namespace property = loopwarden::tests::property;
using namespace loopwarden;
using namespace loopwarden::alarm;

namespace {

constexpr std::int64_t kMinute = 60'000;
constexpr std::int64_t kDay = 24 * 60 * kMinute;

void add(std::vector<AlarmCame>& came, std::int64_t utc_ms, int times, const char* tag,
         const char* alarm, std::int64_t apart_ms) {
  for (int i = 0; i < times; ++i) came.push_back({utc_ms + i * apart_ms, tag, alarm});
}

}  // namespace

TEST_CASE("a quiet day has a rate, and neither flood nor chattering", "[monitor][figures]") {
  std::vector<AlarmCame> came;
  add(came, kDay, 24, "FIC-101", "deviation", 60 * kMinute);
  add(came, kDay + 5 * kMinute, 12, "FIC-102", "bad_pv", 120 * kMinute);
  came.push_back({kDay - 1, "FIC-103", "bad_pv"});
  came.push_back({2 * kDay, "FIC-103", "bad_pv"});
  const AlarmFigures figures = figures_of(came, kDay, 2 * kDay);
  CHECK(figures.came == 36);
  CHECK(figures.per_hour == Approx(1.5));
  CHECK(figures.most_in_stretch == 2);
  CHECK(figures.floods == 0);
  CHECK(figures.flood_percent == 0.0);
  CHECK(figures.chattering.empty());
  REQUIRE(figures.top.size() == 2);
  CHECK(figures.top[0].source == "FIC-101");
  CHECK(figures.top[0].count == 24);
  CHECK(figures.top[0].percent == Approx(66.667).epsilon(1e-4));
}

TEST_CASE("a flood lasts from more than 10 alarms in 10 min to fewer than 5",
          "[monitor][figures]") {
  std::vector<AlarmCame> came;
  add(came, kDay, 11, "A", "x", 50'000);                // 11 in the first stretch
  add(came, kDay + 10 * kMinute, 5, "B", "x", 90'000);  // continues
  add(came, kDay + 20 * kMinute, 4, "C", "x", 90'000);  // has ended
  add(came, kDay + 60 * kMinute, 10, "D", "x", 50'000);
  const AlarmFigures figures = figures_of(came, kDay, kDay + 100 * kMinute);
  CHECK(figures.floods == 1);
  CHECK(figures.flood_percent == Approx(20.0));
  CHECK(figures.most_in_stretch == 11);
}

TEST_CASE("an alarm that is raised three times within a minute chatters", "[monitor][figures]") {
  std::vector<AlarmCame> came;
  add(came, kDay, 3, "A", "bad_pv", 30'000);
  add(came, kDay, 3, "B", "bad_pv", 30'001);
  add(came, kDay + kMinute, 9, "C", "bad_pv", 2'000);
  const AlarmFigures figures = figures_of(came, kDay, 2 * kDay);
  REQUIRE(figures.chattering.size() == 2);
  CHECK(figures.chattering[0].source == "C");
  CHECK(figures.chattering[0].count == 9);
  CHECK(figures.chattering[1].source == "A");
  CHECK(figures.chattering[1].count == 3);
}

TEST_CASE("the figures don't depend on the order, and shares are of all raised alarms",
          "[monitor][figures]") {
  property::for_all("figures", 100, [] {
    std::vector<AlarmCame> came;
    const std::int64_t count = property::integer(0, 60);
    for (std::int64_t i = 0; i < count; ++i) {
      came.push_back({kDay + property::integer(0, kDay - 1),
                      "T" + std::to_string(property::one_of(15)), "bad_pv"});
    }
    const AlarmFigures one = figures_of(came, kDay, 2 * kDay);
    const AlarmFigures other =
        figures_of(std::vector<AlarmCame>(came.rbegin(), came.rend()), kDay, 2 * kDay);
    property::require(one.top == other.top, "top");
    property::require(one.chattering == other.chattering, "chattering");
    property::require(one.floods == other.floods, "floods");
    property::require(one.came == came.size(), "one was not counted");
    property::require(one.top.size() <= AlarmLimits::kTop, "more than ten");
    double share = 0.0;
    for (const CountedAlarm& alarm : one.top) share += alarm.percent;
    property::require(share <= 100.0 + 1e-9, "more than all");
    property::require(one.flood_percent <= 100.0, "longer than the time");
  });
}

TEST_CASE("an empty time range has no figures", "[monitor][figures]") {
  CHECK(figures_of({}, kDay, kDay).came == 0);
  CHECK(figures_of({}, kDay, 2 * kDay).per_hour == 0.0);
}

}  // namespace alarm_figures_test
