// SPDX-License-Identifier: Apache-2.0
#include "services/notify/rules/changes.hpp"

#include <catch2/catch.hpp>
#include <vector>

namespace changes_test {

using namespace loopwarden::notify;

namespace {

AlarmReading reading(const std::string& state, std::int64_t times = 1, double severity = 6.0) {
  return {.key = {"FIC-101", "stiction"},
          .state = state,
          .unacknowledged = state.ends_with("unacknowledged"),
          .times_raised = times,
          .severity_percent = severity};
}

AlarmPicture at(const std::string& state, std::int64_t times = 1) {
  AlarmPicture picture;
  picture.state = state;
  picture.times_raised = times;
  picture.worst_percent = 6.0;
  return picture;
}

std::string told(AlarmPicture picture, const AlarmReading& now) {
  std::string text;
  for (const Event& event : take_changes(picture, now, 1000)) {
    text += (text.empty() ? "" : " ") + std::string(to_text(event.change));
  }
  return text;
}

}  // namespace

TEST_CASE("an alarm's life is notified once, change by change", "[notify][changes]") {
  struct Case {
    const char* before;
    std::int64_t times_before;
    const char* now;
    std::int64_t times_now;
    const char* told;
  };
  const std::vector<Case> cases{
      {"normal", 0, "unacknowledged", 1, "came"},
      {"unacknowledged", 1, "unacknowledged", 1, ""},
      {"unacknowledged", 1, "acknowledged", 1, "acknowledged"},
      {"acknowledged", 1, "normal", 1, "went"},
      {"unacknowledged", 1, "returned_unacknowledged", 1, "went"},
      {"returned_unacknowledged", 1, "normal", 1, "acknowledged"},
      {"acknowledged", 1, "latched_acknowledged", 1, "went"},
      {"unacknowledged", 1, "latched_unacknowledged", 1, "went"},
      {"latched_unacknowledged", 1, "latched_acknowledged", 1, "acknowledged"},
      {"latched_acknowledged", 1, "normal", 1, ""},
      {"unacknowledged", 1, "shelved", 1, "shelved"},
      {"shelved", 1, "unacknowledged", 1, "came"},
      {"shelved", 1, "normal", 1, ""},
      {"normal", 1, "suppressed", 1, ""},
      {"suppressed", 1, "normal", 1, ""},
      // A consequence of another alarm. Only the other alarm is notified.
      {"unacknowledged", 1, "suppressed", 1, "went"},
      {"suppressed", 1, "acknowledged", 1, "came acknowledged"},
      // Withdrawn, because it got another name.
      {"unacknowledged", 1, "normal", 1, "went"},
      // Between two looks.
      {"normal", 1, "normal", 2, "came went"},
      {"normal", 1, "acknowledged", 2, "came acknowledged"},
      {"normal", 1, "returned_unacknowledged", 2, "came went"},
      {"acknowledged", 1, "unacknowledged", 2, "came"},
      {"unacknowledged", 1, "unacknowledged", 2, "came"},
      {"normal", 1, "shelved", 2, "shelved"},
  };
  for (const Case& one : cases) {
    INFO(one.before << " (" << one.times_before << ") -> " << one.now << " (" << one.times_now
                    << ")");
    CHECK(told(at(one.before, one.times_before), reading(one.now, one.times_now)) == one.told);
  }
}

TEST_CASE("a change has the time at which it happened, and the time at which it was read",
          "[notify][changes]") {
  const auto event = [](AlarmPicture picture, AlarmReading now, std::int64_t raised_ms,
                        std::int64_t changed_ms) {
    now.raised_ms = raised_ms;
    now.changed_ms = changed_ms;
    const std::vector<Event> events = take_changes(picture, now, 1000);
    CHECK(events.at(0).noticed_ms == 1000);
    return events.at(0);
  };
  const AlarmReading raised = reading("unacknowledged", 2);
  CHECK(event(at("normal"), raised, 400, 400).utc_ms == 400);
  // Active for a long time before the program first saw it.
  CHECK(event(first_picture(raised), raised, 7, 7).utc_ms == 7);
  CHECK(event(at("unacknowledged"), reading("acknowledged"), 400, 600).utc_ms == 600);
  CHECK(event(at("acknowledged"), reading("normal"), 400, 700).utc_ms == 700);
  CHECK(event(at("normal"), reading("shelved"), 400, 800).utc_ms == 800);
  // Hidden by another alarm, and visible again: the alarm itself did not change then.
  CHECK(event(at("unacknowledged"), reading("suppressed"), 400, 400).utc_ms == 1000);
  CHECK(event(at("suppressed"), reading("unacknowledged"), 400, 400).utc_ms == 1000);
  CHECK(event(at("shelved"), reading("unacknowledged"), 400, 900).utc_ms == 1000);
  // Times of a clock that was set back, or of a daemon that does not send them.
  CHECK(event(at("normal"), raised, 5000, 5000).utc_ms == 1000);
  CHECK(event(at("normal"), raised, 0, 0).utc_ms == 1000);
}

TEST_CASE("the first reading of an alarm notifies only its present state", "[notify][changes]") {
  CHECK(told(first_picture(reading("normal", 12)), reading("normal", 12)).empty());
  CHECK(told(first_picture(reading("unacknowledged", 12)), reading("unacknowledged", 12)) ==
        "came");
}

TEST_CASE("an event that has waited carries what is known when it is sent", "[notify][changes]") {
  AlarmReading gap = reading("unacknowledged", 1);
  gap.key = {"F", "model_gap"};
  gap.incident = "F-1";
  gap.severity_percent.reset();
  gap.why = "something has changed";
  AlarmReading sticks = reading("normal", 0, 7.5);
  sticks.key = {"F", "stiction"};
  sticks.incident = "F-1";
  sticks.why = "the valve sticks";
  sticks.action = "repack it";
  const auto told_now = [&](Change change = Change::came) {
    Event event{.utc_ms = 5, .loop = "F", .alarm = "model_gap", .change = change};
    const std::array all{gap, sticks};
    bring_up_to_date(event, all);
    return event;
  };
  CHECK(told_now().alarm == "model_gap");
  CHECK(told_now().why == "something has changed");
  sticks.state = "unacknowledged";
  const Event named = told_now();
  CHECK(named.utc_ms == 5);
  CHECK(named.alarm == "stiction");
  CHECK(named.why == "the valve sticks");
  CHECK(named.action == "repack it");
  CHECK(named.severity_percent == 7.5);
  CHECK(told_now(Change::went).alarm == "model_gap");
  sticks.incident = "F-2";
  CHECK(told_now().alarm == "model_gap");
  // A cleared alarm keeps its event unchanged.
  gap.state = "normal";
  CHECK(told_now().why.empty());
}

TEST_CASE("the worst size since it was raised is remembered until it is raised again",
          "[notify][changes]") {
  AlarmPicture picture;
  take_changes(picture, reading("unacknowledged", 1, 4.0), 1);
  take_changes(picture, reading("unacknowledged", 1, 9.0), 2);
  take_changes(picture, reading("unacknowledged", 1, 5.0), 3);
  CHECK(picture.worst_percent == 9.0);
  CHECK(picture.since_ms == 1);
  CHECK(take_changes(picture, reading("normal", 1, 5.0), 4).front().worst_percent == 9.0);
  take_changes(picture, reading("unacknowledged", 2, 2.0), 5);
  CHECK(picture.worst_percent == 2.0);
  CHECK(picture.since_ms == 5);
}

}  // namespace changes_test
