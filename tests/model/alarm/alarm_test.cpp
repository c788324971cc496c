// SPDX-License-Identifier: Apache-2.0
#include "model/alarm/alarm.hpp"

#include <array>
#include <catch2/catch.hpp>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace alarm_test {

using namespace loopwarden;
using namespace loopwarden::alarm;

namespace {

using S = AlarmState;

constexpr std::int64_t kMinute = 60'000;  // ms
constexpr std::int64_t kNow = 1'800'000'000'000;
constexpr std::int64_t kLimit = 480 * kMinute;

enum class Event {
  on,
  off,
  not_valid,
  explained,
  not_explained,
  acknowledge,
  reset,
  shelve,
  unshelve,
  shelf_ends
};
constexpr std::array kEvents{
    Event::on,          Event::off,   Event::not_valid, Event::explained, Event::not_explained,
    Event::acknowledge, Event::reset, Event::shelve,    Event::unshelve,  Event::shelf_ends};

Alarm alarm_in(S raised, bool shelved, bool valid, bool explained, bool latching) {
  AlarmMemory memory;
  memory.raised = raised;
  memory.raised_ms = kNow - 5;
  memory.shelved_until_ms = shelved ? kNow + kMinute : 0;
  Alarm alarm({.latching = latching, .shelve_limit_ms = kLimit}, memory);
  if (valid) {
    // A judged window that agrees with the state changes only the validity.
    if (raised == S::unacknowledged || raised == S::acknowledged) {
      alarm.condition_on(kNow - 1, 5.0);
    } else {
      alarm.condition_off(kNow - 1);
    }
  }
  alarm.set_consequence(explained);
  return alarm;
}

// Returns whether an operator's action was taken; true for an event that is no action.
bool apply(Alarm& alarm, Event event) {
  switch (event) {
    case Event::on: alarm.condition_on(kNow, 7.0); return true;
    case Event::off: alarm.condition_off(kNow); return true;
    case Event::not_valid: alarm.window_not_valid(); return true;
    case Event::explained: alarm.set_consequence(true); return true;
    case Event::not_explained: alarm.set_consequence(false); return true;
    case Event::acknowledge: return alarm.acknowledge(kNow);
    case Event::reset: return alarm.reset(kNow);
    case Event::shelve: return alarm.shelve(kNow, kNow + 10 * kMinute);
    case Event::unshelve: return alarm.unshelve(kNow);
    case Event::shelf_ends: alarm.pass_time(kNow + kMinute); return true;
  }
  return false;
}

// The expected transitions. Rows are the states without shelf and suppression.
struct Row {
  S before;
  S on;
  S off;
  S off_latching;
  S acknowledged;  // the same state as before: refused
  S reset;         // the same state as before: refused
  S off_shelf;
};
constexpr std::array<Row, 6> kTable{{
    {S::normal, S::unacknowledged, S::normal, S::normal, S::normal, S::normal, S::normal},
    {S::unacknowledged, S::unacknowledged, S::returned_unacknowledged, S::latched_unacknowledged,
     S::acknowledged, S::unacknowledged, S::unacknowledged},
    {S::acknowledged, S::acknowledged, S::normal, S::latched_acknowledged, S::acknowledged,
     S::acknowledged, S::unacknowledged},
    {S::returned_unacknowledged, S::unacknowledged, S::returned_unacknowledged,
     S::returned_unacknowledged, S::normal, S::returned_unacknowledged, S::normal},
    {S::latched_unacknowledged, S::unacknowledged, S::latched_unacknowledged,
     S::latched_unacknowledged, S::latched_acknowledged, S::returned_unacknowledged,
     S::latched_unacknowledged},
    {S::latched_acknowledged, S::unacknowledged, S::latched_acknowledged, S::latched_acknowledged,
     S::latched_acknowledged, S::normal, S::latched_acknowledged},
}};

S visible(S raised, bool shelved, bool valid, bool explained) {
  if (shelved) return S::shelved;
  if (explained || (raised == S::normal && !valid)) return S::suppressed;
  return raised;
}

}  // namespace

TEST_CASE("every state and every event follow the table", "[monitor][alarm]") {
  for (const Row& row : kTable) {
    for (const bool shelved : {false, true}) {
      for (const bool valid : {false, true}) {
        for (const bool explained : {false, true}) {
          for (const bool latching : {false, true}) {
            for (const Event event : kEvents) {
              Alarm alarm = alarm_in(row.before, shelved, valid, explained, latching);
              INFO("from " << to_text(row.before) << ", shelved " << shelved << ", valid " << valid
                           << ", explained " << explained << ", latching " << latching << ", event "
                           << static_cast<int>(event));
              REQUIRE(alarm.memory().raised == row.before);
              REQUIRE(alarm.state() == visible(row.before, shelved, valid, explained));
              const bool taken = apply(alarm, event);

              S raised = row.before;
              bool shelved_now = shelved;
              bool valid_now = valid;
              bool explained_now = explained;
              bool expect_taken = true;
              switch (event) {
                case Event::on:
                  raised = row.on;
                  valid_now = true;
                  break;
                case Event::off:
                  raised = latching ? row.off_latching : row.off;
                  valid_now = true;
                  break;
                case Event::not_valid: valid_now = false; break;
                case Event::explained: explained_now = true; break;
                case Event::not_explained: explained_now = false; break;
                case Event::acknowledge:
                  expect_taken = !shelved && row.acknowledged != row.before;
                  if (expect_taken) raised = row.acknowledged;
                  break;
                case Event::reset:
                  expect_taken = !shelved && row.reset != row.before;
                  if (expect_taken) raised = row.reset;
                  break;
                case Event::shelve: shelved_now = true; break;
                case Event::unshelve:
                case Event::shelf_ends:
                  expect_taken = event == Event::shelf_ends || shelved;
                  if (shelved) raised = row.off_shelf;
                  shelved_now = false;
                  break;
              }
              CHECK(taken == expect_taken);
              CHECK(alarm.memory().raised == raised);
              CHECK(alarm.shelved() == shelved_now);
              CHECK(alarm.state() == visible(raised, shelved_now, valid_now, explained_now));
              const bool on = raised == S::unacknowledged || raised == S::acknowledged;
              CHECK(alarm.active() == on);
              const bool waits = raised == S::unacknowledged ||
                                 raised == S::returned_unacknowledged ||
                                 raised == S::latched_unacknowledged;
              CHECK(alarm.unacknowledged() == (waits && !shelved_now && !explained_now));
            }
          }
        }
      }
    }
  }
}

TEST_CASE("texts and numbers that are a contract with users", "[monitor][alarm]") {
  const std::vector<std::pair<int, std::string>> promised{{0, "normal"},
                                                          {1, "unacknowledged"},
                                                          {2, "acknowledged"},
                                                          {3, "returned_unacknowledged"},
                                                          {4, "latched_unacknowledged"},
                                                          {5, "latched_acknowledged"},
                                                          {6, "shelved"},
                                                          {7, "suppressed"}};
  REQUIRE(promised.size() == kAlarmStates);
  for (const auto& [number, text] : promised) {
    CHECK(to_text(static_cast<AlarmState>(number)) == text);
  }
}

TEST_CASE("before the first window an alarm can't be raised, and reports this",
          "[monitor][alarm]") {
  Alarm alarm;
  CHECK(alarm.state() == S::suppressed);
  alarm.condition_off(kNow);
  CHECK(alarm.state() == S::normal);
}

TEST_CASE("a shelving ends by itself, and is never longer than the limit", "[monitor][alarm]") {
  Alarm alarm({.latching = false, .shelve_limit_ms = 10 * kMinute});
  CHECK_FALSE(alarm.shelve(kNow, kNow));
  CHECK_FALSE(alarm.shelve(kNow, kNow - 1));
  CHECK_FALSE(alarm.shelve(kNow, kNow + 10 * kMinute + 1));
  CHECK_FALSE(alarm.shelved());
  REQUIRE(alarm.shelve(kNow, kNow + 10 * kMinute));
  CHECK_FALSE(alarm.pass_time(kNow + 10 * kMinute - 1));
  CHECK(alarm.shelved());
  CHECK(alarm.pass_time(kNow + 10 * kMinute));
  CHECK_FALSE(alarm.shelved());
  SECTION("a second shelving while on the shelf replaces the first") {
    REQUIRE(alarm.shelve(kNow, kNow + kMinute));
    REQUIRE(alarm.shelve(kNow, kNow + 5 * kMinute));
    CHECK_FALSE(alarm.pass_time(kNow + 2 * kMinute));
    CHECK(alarm.pass_time(kNow + 5 * kMinute));
  }
  SECTION("a clock that was set back by a day does not prolong it") {
    REQUIRE(alarm.shelve(kNow, kNow + 5 * kMinute));
    CHECK(alarm.pass_time(kNow - 1440 * kMinute));
  }
}

TEST_CASE("severity: the newest, and the worst since the alarm was raised", "[monitor][alarm]") {
  Alarm alarm;
  alarm.condition_on(kNow, 4.0);
  alarm.condition_on(kNow + 1, 9.0);
  alarm.condition_on(kNow + 2, 6.0);
  CHECK(alarm.memory().severity_percent == 6.0);
  CHECK(alarm.memory().worst_severity_percent == 9.0);
  CHECK(alarm.memory().raised_ms == kNow);
  CHECK(alarm.memory().times_raised == 1);
  alarm.condition_off(kNow + 3);
  alarm.condition_on(kNow + 4, 2.0);
  CHECK(alarm.memory().worst_severity_percent == 2.0);
  CHECK(alarm.memory().raised_ms == kNow + 4);
  CHECK(alarm.memory().times_raised == 2);
  alarm.condition_on(kNow + 5, std::numeric_limits<double>::quiet_NaN());
  CHECK(alarm.memory().severity_percent == 0.0);
}

TEST_CASE("a restart restores the remembered state, except impossible ones", "[monitor][alarm]") {
  Alarm before;
  before.condition_on(kNow, 4.0);
  REQUIRE(before.acknowledge(kNow + 1));
  REQUIRE(before.shelve(kNow + 2, kNow + kMinute));
  Alarm after(before.settings(), before.memory());
  CHECK(after.memory() == before.memory());
  CHECK(after.state() == S::shelved);

  AlarmMemory wrong = before.memory();
  SECTION("a state that is impossible below the shelf") { wrong.raised = S::shelved; }
  SECTION("a number that is no state") { wrong.raised = static_cast<AlarmState>(200); }
  SECTION("a negative time") { wrong.shelved_until_ms = -1; }
  SECTION("a severity that is no number") {
    wrong.severity_percent = std::numeric_limits<double>::infinity();
  }
  const Alarm fresh(before.settings(), wrong);
  CHECK(fresh.memory() == AlarmMemory{});
}

}  // namespace alarm_test
