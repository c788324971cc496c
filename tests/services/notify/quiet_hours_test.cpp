// SPDX-License-Identifier: Apache-2.0
#include "services/notify/rules/quiet_hours.hpp"

#include <date/date.h>

#include <catch2/catch.hpp>
#include <sstream>

namespace quiet_hours_test {

using namespace loopwarden::notify;

namespace {

// "2026-03-29 01:30", UTC.
std::int64_t at(const std::string& text) {
  std::istringstream stream(text);
  date::sys_time<std::chrono::minutes> time;
  stream >> date::parse("%F %R", time);
  REQUIRE(!stream.fail());
  return time.time_since_epoch().count() * 60'000;
}

std::string end(const QuietHours& hours, const std::string& now) {
  const auto until = quiet_until(hours, at(now));
  if (!until) return "-";
  return date::format("%F %R",
                      date::sys_time<std::chrono::minutes>{std::chrono::minutes(*until / 60'000)});
}

QuietHours hours(const std::string& zone, int from_min, int to_min) {
  QuietHours one;
  one.channels = {"mail"};
  one.zone = find_zone(zone);
  REQUIRE(one.zone != nullptr);
  one.from_min = from_min;
  one.to_min = to_min;
  return one;
}

}  // namespace

TEST_CASE("quiet hours over midnight, in the zone's own time", "[notify][quiet]") {
  const QuietHours night = hours("Europe/Berlin", 22 * 60, 6 * 60);  // winter: UTC + 1
  CHECK(end(night, "2026-01-10 20:59") == "-");
  CHECK(end(night, "2026-01-10 21:00") == "2026-01-11 05:00");
  CHECK(end(night, "2026-01-11 04:59") == "2026-01-11 05:00");
  CHECK(end(night, "2026-01-11 05:00") == "-");
  const QuietHours noon = hours("America/St_Johns", 12 * 60, 13 * 60 + 30);  // UTC - 3:30
  CHECK(end(noon, "2026-01-10 15:29") == "-");
  CHECK(end(noon, "2026-01-10 15:30") == "2026-01-10 17:00");
  const QuietHours to_midnight = hours("UTC", 20 * 60, 24 * 60);
  CHECK(end(to_midnight, "2026-01-10 23:59") == "2026-01-11 00:00");
  CHECK(end(to_midnight, "2026-01-11 00:00") == "-");
}

TEST_CASE("quiet hours where clocks are put forward and back", "[notify][quiet]") {
  // 2026-03-29: 02:00 becomes 03:00. 2026-10-25: 03:00 becomes 02:00.
  const QuietHours night = hours("Europe/Berlin", 22 * 60, 6 * 60);
  CHECK(end(night, "2026-03-28 21:00") == "2026-03-29 04:00");  // seven hours
  CHECK(end(night, "2026-03-29 03:59") == "2026-03-29 04:00");
  CHECK(end(night, "2026-03-29 04:00") == "-");
  CHECK(end(night, "2026-10-24 20:00") == "2026-10-25 05:00");  // nine hours
  CHECK(end(night, "2026-10-25 04:30") == "2026-10-25 05:00");

  // The hours end at a time that does not exist: they end with the change.
  const QuietHours short_night = hours("Europe/Berlin", 22 * 60, 2 * 60 + 30);
  CHECK(end(short_night, "2026-03-29 00:59") == "2026-03-29 01:00");
  CHECK(end(short_night, "2026-03-29 01:00") == "-");
  // The hours end at a time that occurs twice: they end at the second, without a gap.
  CHECK(end(short_night, "2026-10-25 00:45") == "2026-10-25 01:30");  // after the first 02:30
  CHECK(end(short_night, "2026-10-25 01:15") == "2026-10-25 01:30");
  CHECK(end(short_night, "2026-10-25 01:30") == "-");
  // The hours begin at a time that occurs twice: they begin at the first.
  const QuietHours late = hours("Europe/Berlin", 2 * 60 + 30, 5 * 60);
  CHECK(end(late, "2026-10-25 00:29") == "-");
  CHECK(end(late, "2026-10-25 00:30") == "2026-10-25 04:00");
  // The hours begin at a time that does not exist: they begin with the change.
  CHECK(end(late, "2026-03-29 00:59") == "-");
  CHECK(end(late, "2026-03-29 01:00") == "2026-03-29 03:00");
}

TEST_CASE("quiet hours only on the days on which they begin", "[notify][quiet]") {
  QuietHours weekend = hours("Europe/Berlin", 22 * 60, 6 * 60);
  weekend.begins_on = {false, false, false, false, true, true, false};
  CHECK(end(weekend, "2026-01-09 22:00") == "2026-01-10 05:00");  // Friday
  CHECK(end(weekend, "2026-01-10 22:00") == "2026-01-11 05:00");
  CHECK(end(weekend, "2026-01-11 04:00") == "2026-01-11 05:00");
  CHECK(end(weekend, "2026-01-11 22:00") == "-");  // Sunday
}

TEST_CASE("severe and listed alarms leave all the same, and other channels always",
          "[notify][quiet]") {
  QuietHours night = hours("UTC", 22 * 60, 6 * 60);
  night.override_severity_percent = 10.0;
  night.override_alarms = {kDaemonAlarm};
  const std::vector<QuietHours> all{night};
  const std::int64_t now = at("2026-01-10 23:00");
  Event event{.alarm = "stiction",
              .state = "unacknowledged",
              .severity_percent = 5.0,
              .worst_percent = 9.9};
  event.loop = "F";
  const auto is_held = [&](const std::string& channel) {
    return held(quiet_now(all, channel, now), event);
  };
  CHECK(is_held("mail"));
  CHECK(!is_held("log"));
  event.worst_percent = 10.0;
  CHECK(!is_held("mail"));
  event.worst_percent.reset();
  CHECK(is_held("mail"));
  event.alarm = kDaemonAlarm;
  CHECK(!is_held("mail"));
  CHECK(quiet_now(all, "mail", at("2026-01-10 06:00")).empty());
}

TEST_CASE("an unknown time zone", "[notify][quiet]") {
  CHECK(find_zone("Europe/Atlantis") == nullptr);
  CHECK(find_zone("../../etc/passwd") == nullptr);
}

}  // namespace quiet_hours_test
