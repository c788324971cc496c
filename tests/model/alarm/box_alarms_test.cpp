// SPDX-License-Identifier: Apache-2.0
#include "model/alarm/box_alarms.hpp"

#include <catch2/catch.hpp>

namespace box_alarms_test {

using namespace loopwarden;
using namespace loopwarden::alarm;
using B = BoxAlarm;
using S = AlarmState;

namespace {

BoxFindings all(bool there) {
  BoxFindings found;
  found.fill(there);
  return found;
}

BoxFindings with(B kind, std::optional<bool> there) {
  BoxFindings found = all(false);
  found[index_of(kind)] = there;
  return found;
}

}  // namespace

TEST_CASE("a host alarm is raised, waits for the operator, and clears after a healthy minute",
          "[monitor][box]") {
  BoxAlarms alarms{AlarmSettings{}};
  CHECK_FALSE(alarms.found(all(false), 0, 1000));
  CHECK(alarms.found(with(B::disk_full, true), 5'000, 6000));
  CHECK(alarms.alarm(B::disk_full).state() == S::unacknowledged);
  CHECK(alarms.alarm(B::disk_full).memory().raised_ms == 6000);
  CHECK(alarms.active() == 1U);
  CHECK(alarms.act(B::disk_full, AlarmAction::acknowledge, 7000, 0));
  CHECK_FALSE(alarms.act(B::disk_full, AlarmAction::acknowledge, 7000, 0));
  CHECK_FALSE(alarms.found(all(false), 10'000, 11'000));
  CHECK_FALSE(alarms.found(all(false), 69'999, 71'000));
  CHECK(alarms.found(all(false), 70'000, 71'001));
  CHECK(alarms.alarm(B::disk_full).state() == S::normal);
}

TEST_CASE("a service that restarts by itself is no alarm; an unanswered query keeps the state",
          "[monitor][box]") {
  BoxAlarms alarms{AlarmSettings{}};
  alarms.found(with(B::service_failed, true), 0, 1);
  alarms.found(all(false), 29'000, 1);
  alarms.found(with(B::service_failed, true), 30'000, 1);
  alarms.found(with(B::service_failed, std::nullopt), 59'000, 1);
  alarms.found(with(B::service_failed, true), 60'000, 1);
  CHECK(alarms.alarm(B::service_failed).state() == S::normal);
  alarms.found(with(B::service_failed, true), 90'000, 1);
  CHECK(alarms.alarm(B::service_failed).state() == S::unacknowledged);
}

TEST_CASE("host alarms are shelved for a time, and remembered", "[monitor][box]") {
  BoxAlarms before{AlarmSettings{}};
  before.found(with(B::certificate_expires, true), 0, 1000);
  REQUIRE(before.act(B::certificate_expires, AlarmAction::shelve, 2000, 62'000));
  BoxAlarms after{AlarmSettings{}};
  after.restore(B::certificate_expires, before.alarm(B::certificate_expires).memory());
  CHECK(after.alarm(B::certificate_expires).state() == S::shelved);
  CHECK(after.found(with(B::certificate_expires, true), 0, 62'000));
  CHECK(after.alarm(B::certificate_expires).state() == S::unacknowledged);
  CHECK(after.alarm(B::certificate_expires).memory().times_raised == 1);
}

}  // namespace box_alarms_test
