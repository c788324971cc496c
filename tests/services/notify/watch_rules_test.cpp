// SPDX-License-Identifier: Apache-2.0
#include "services/notify/rules/watch_rules.hpp"

#include <array>
#include <catch2/catch.hpp>
#include <vector>

namespace watch_rules_test {

using namespace loopwarden::notify;

namespace {

constexpr std::int64_t kStart = 1'795'521'600'000;

Route route(std::vector<std::string> channels, double min_severity = 0.0) {
  Route one;
  one.changes = {true, true, false, false};
  one.min_severity_percent = min_severity;
  one.channels = std::move(channels);
  return one;
}

AlarmReading reading(const std::string& loop, const std::string& state, double severity = 6.0,
                     std::int64_t times = 1) {
  return {.key = {loop, "stiction"},
          .state = state,
          .unacknowledged = state.ends_with("unacknowledged"),
          .times_raised = times,
          .severity_percent = severity};
}

// Returns for example "mail:came mail:went", in the order of the posts.
std::string told(const Step& step) {
  std::string text;
  for (const Post& post : step.posts) {
    text += (text.empty() ? "" : " ") + post.channel + ":" + to_text(post.event.change);
  }
  return text;
}

struct Rules {
  RuleSettings settings;
  WatchRules rules{settings, {}};

  std::string read(const AlarmReading& reading, std::int64_t now_ms,
                   std::vector<JournalLine> lines = {}) {
    const Step step = rules.read(std::span(&reading, 1), lines, now_ms);
    rules.accept(step);
    return told(step);
  }
  std::string silence(std::int64_t silent_ms, std::int64_t now_ms) {
    const Step step = rules.silence(silent_ms, now_ms);
    rules.accept(step);
    return told(step);
  }
};

}  // namespace

TEST_CASE("loops, alarms, states and sizes decide who is notified", "[notify][routes]") {
  Rules all;
  Route some = route({"mail"});
  some.loops = {"FIC-1*", "L?C-7"};
  some.alarms = {"stiction"};
  all.settings.routes = {some, route({"log", "mail"}, 20.0)};
  CHECK(all.read(reading("FIC-101", "unacknowledged"), kStart) == "mail:came");
  CHECK(all.read(reading("LIC-7", "unacknowledged"), kStart).starts_with("mail:"));
  CHECK(all.read(reading("PIC-7", "unacknowledged"), kStart).find("came") == std::string::npos);
  // Both routes apply: one message per channel.
  CHECK(all.read(reading("FIC-102", "unacknowledged", 25.0), kStart) == "log:came mail:came");
}

TEST_CASE("a route of an area has all its parts", "[notify][routes]") {
  Rules unit;
  Route two = route({"mail"});
  two.areas = {"Unit 2"};
  unit.settings.routes = {two, route({"log"})};
  const auto of_area = [&](const char* loop, const char* area) {
    AlarmReading one = reading(loop, "unacknowledged");
    one.area = area;
    return unit.read(one, kStart);
  };
  CHECK(of_area("FIC-1", "Unit 2") == "log:came mail:came");
  CHECK(of_area("FIC-2", "Unit 2/Reactor").find("mail:came") != std::string::npos);
  CHECK(of_area("FIC-3", "Unit 21").find("mail") == std::string::npos);
  CHECK(of_area("FIC-4", "").find("mail") == std::string::npos);
}

TEST_CASE("an alarm of the box uses the routes that name the box, or otherwise all routes",
          "[notify][routes]") {
  AlarmReading full = reading("box", "unacknowledged");
  full.key.second = "disk_full";
  full.severity_percent.reset();
  Route log = route({"log"});
  log.logs_only = true;
  Route operators = route({"mail"});
  operators.loops = {"FIC-*"};
  Route shop = route({"shop"});
  shop.alarms = {"stiction"};
  Rules all;
  SECTION("no route to people names the box: all routes with the alarm apply") {
    all.settings.routes = {log, operators, shop};
    CHECK(box_way(all.settings.routes, "disk_full") == BoxWay::all);
    CHECK(all.read(full, kStart) == "log:came mail:came");
    full.state = "normal";
    full.unacknowledged = false;
    CHECK(all.read(full, kStart + 1000) == "log:went mail:went");
  }
  SECTION("a route that names the box is the only one to people") {
    Route it = route({"it"});
    it.loops = {"LIC-1", "box"};
    all.settings.routes = {log, operators, it};
    CHECK(box_way(all.settings.routes, "disk_full") == BoxWay::own);
    CHECK(all.read(full, kStart) == "it:came log:came");
  }
  SECTION("a route without raised alarms is no route to people") {
    Route it = route({"it"});
    it.loops = {"box"};
    it.changes = {false, false, true, false};
    all.settings.routes = {operators, it};
    CHECK(box_way(all.settings.routes, "disk_full") == BoxWay::all);
    CHECK(all.read(full, kStart) == "mail:came");
  }
  SECTION("with only logs, or only routes of other alarms") {
    CHECK(box_way({log}, "disk_full") == BoxWay::logs);
    CHECK(box_way({shop}, "disk_full") == BoxWay::none);
    all.settings.routes = {shop};
    CHECK(all.read(full, kStart).empty());
  }
  SECTION("a loop's tag uses only routes with a matching pattern") {
    all.settings.routes = {operators};
    CHECK(all.read(reading("LIC-1", "unacknowledged"), kStart).empty());
  }
}

TEST_CASE("a route with a least size receives an alarm that grows to this size, and its end",
          "[notify][routes]") {
  Rules all;
  all.settings.routes = {route({"log"}), route({"mail"}, 10.0)};
  CHECK(all.read(reading("F", "unacknowledged", 6.0), kStart) == "log:came");
  CHECK(all.read(reading("F", "unacknowledged", 12.0), kStart + 1000) == "mail:came");
  CHECK(all.read(reading("F", "unacknowledged", 8.0), kStart + 2000).empty());
  CHECK(all.read(reading("F", "unacknowledged", 13.0), kStart + 3000).empty());
  CHECK(all.read(reading("F", "normal", 8.0), kStart + 4000) == "log:went mail:went");
  // The alarm stayed below the least size, so its end isn't notified either.
  CHECK(all.read(reading("F", "unacknowledged", 6.0, 2), kStart + 5000) == "log:came");
  CHECK(all.read(reading("F", "normal", 6.0, 2), kStart + 6000) == "log:went");
}

TEST_CASE("the person and reason of an acknowledgement are read from the daemon's journal",
          "[notify][routes]") {
  Rules all;
  Route acknowledged = route({"log"});
  acknowledged.changes = {true, true, true, true};
  all.settings.routes = {acknowledged};
  all.read(reading("F", "unacknowledged"), kStart);
  const AlarmReading now = reading("F", "acknowledged");
  const std::vector<JournalLine> lines{{.id = 9,
                                        .kind = "alarm",
                                        .key = {"F", "stiction"},
                                        .from = "unacknowledged",
                                        .to = "acknowledged",
                                        .peer = {},
                                        .what = {},
                                        .reason = {}},
                                       {.id = 8,
                                        .kind = "operator",
                                        .key = {"F", "stiction"},
                                        .to = {},
                                        .peer = "uid 1000",
                                        .what = "acknowledge",
                                        .reason = "seen"},
                                       {.id = 7,
                                        .kind = "operator",
                                        .key = {"F", "stiction"},
                                        .to = {},
                                        .peer = "uid 1",
                                        .what = "acknowledge",
                                        .reason = "old"}};
  const Step step = all.rules.read(std::span(&now, 1), lines, kStart + 1000);
  REQUIRE(step.posts.size() == 1);
  CHECK(step.posts.front().event.peer == "uid 1000");
  CHECK(step.posts.front().event.reason == "seen");
}

TEST_CASE("an alarm raised and cleared between two looks has the reason of each",
          "[notify][routes]") {
  Rules all;
  all.settings.routes = {route({"log"})};
  all.read(reading("F", "normal", 6.0, 1), kStart);
  AlarmReading now = reading("F", "normal", 6.0, 2);
  now.raised_ms = kStart + 200;
  now.changed_ms = kStart + 700;
  const auto line = [](const char* from, const char* to, const char* reason) {
    return JournalLine{.id = 1,
                       .kind = "alarm",
                       .key = {"F", "stiction"},
                       .from = from,
                       .to = to,
                       .peer = {},
                       .what = {},
                       .reason = reason};
  };
  const std::vector<JournalLine> lines{
      line("returned_unacknowledged", "normal", "seen"),
      line("unacknowledged", "returned_unacknowledged", "it moves again"),
      line("normal", "unacknowledged", "it sticks")};
  const Step step = all.rules.read(std::span(&now, 1), lines, kStart + 1000);
  REQUIRE(told(step) == "log:came log:went");
  CHECK(step.posts[0].event.reason == "it sticks");
  CHECK(step.posts[0].event.utc_ms == kStart + 200);
  CHECK(step.posts[1].event.reason == "it moves again");
  CHECK(step.posts[1].event.utc_ms == kStart + 700);
}

TEST_CASE("repeats and escalation continue until an acknowledgement", "[notify][reminders]") {
  constexpr std::int64_t kMin = 60'000;
  Rules all;
  Route one = route({"mail"});
  one.reminders = {{60, 60, 2, {"mail"}}, {15, 0, 0, {"boss"}}, {30, 30, 1, {"plant"}}};
  all.settings.routes = {one};
  const AlarmReading on = reading("F", "unacknowledged");
  CHECK(all.read(on, kStart) == "mail:came");
  std::vector<std::string> log;
  for (std::int64_t minute = 1; minute < 400; ++minute) {
    const std::string said = all.read(on, kStart + minute * kMin);
    if (!said.empty()) log.push_back(std::to_string(minute) + " " + said);
  }
  CHECK(log == std::vector<std::string>{"15 boss:unacknowledged", "30 plant:unacknowledged",
                                        "60 mail:unacknowledged plant:unacknowledged",
                                        "120 mail:unacknowledged", "180 mail:unacknowledged"});

  SECTION("an acknowledgement ends the reminders; an alarm raised again starts them again") {
    all.read(reading("F", "acknowledged"), kStart + 400 * kMin);
    CHECK(all.read(reading("F", "unacknowledged", 6.0, 2), kStart + 500 * kMin) == "mail:came");
    CHECK(all.read(reading("F", "acknowledged", 6.0, 2), kStart + 510 * kMin).empty());
    CHECK(all.read(reading("F", "acknowledged", 6.0, 2), kStart + 600 * kMin).empty());
  }
  SECTION("a cleared alarm without acknowledgement still causes reminders") {
    Rules gone;
    gone.settings.routes = {one};
    gone.read(on, kStart);
    CHECK(gone.read(reading("F", "returned_unacknowledged"), kStart + kMin) == "mail:went");
    CHECK(gone.read(reading("F", "returned_unacknowledged"), kStart + 16 * kMin) ==
          "boss:unacknowledged");
  }
}

TEST_CASE(
    "reminders due while the program was away are sent once; a clock set back starts them again",
    "[notify][reminders]") {
  constexpr std::int64_t kMin = 60'000;
  Rules all;
  Route one = route({"mail"});
  one.reminders = {{10, 10, 99, {"mail"}}};
  all.settings.routes = {one};
  const AlarmReading on = reading("F", "unacknowledged");
  all.read(on, kStart);
  CHECK(all.read(on, kStart + 95 * kMin) == "mail:unacknowledged");
  CHECK(all.read(on, kStart + 96 * kMin).empty());
  CHECK(all.read(on, kStart - 600 * kMin).empty());
  CHECK(all.read(on, kStart - 589 * kMin) == "mail:unacknowledged");
}

TEST_CASE("a silent daemon raises a separate alarm, once", "[notify][daemon]") {
  Rules all;
  all.settings.routes = {route({"mail"}, 50.0)};
  all.settings.daemon_down_after_ms = 15'000;
  CHECK(all.silence(0, kStart).empty());
  CHECK(all.silence(14'000, kStart + 14'000).empty());
  CHECK(all.silence(15'000, kStart + 15'000) == "mail:came");
  CHECK(all.silence(16'000, kStart + 16'000).empty());
  CHECK(all.silence(0, kStart + 20'000) == "mail:went");
  CHECK(all.silence(0, kStart + 21'000).empty());
  // Alarms read in between don't affect the alarm.
  all.silence(20'000, kStart + 50'000);
  CHECK(all.read(reading("F", "normal"), kStart + 50'000).empty());
  CHECK(all.silence(1'000, kStart + 51'000).empty());
  CHECK(all.silence(0, kStart + 52'000) == "mail:went");
}

TEST_CASE("an alarm of a removed loop ends", "[notify][changes]") {
  Rules all;
  all.settings.routes = {route({"mail"})};
  all.read(reading("F", "unacknowledged"), kStart);
  CHECK(all.read(reading("G", "normal"), kStart + 1000) == "mail:went");
  CHECK(all.read(reading("G", "normal"), kStart + 2000).empty());
}

TEST_CASE("alarms of one incident are notified as one, on each channel", "[notify][incident]") {
  Rules all;
  Route operators = route({"mail"});
  operators.changes = {true, true, true, true};
  operators.reminders = {{.after_min = 10, .channels = {"phone"}}};
  Route severe = route({"sms"}, 10.0);
  severe.alarms = {"stiction"};
  all.settings.routes = {operators, severe};
  const auto read = [&](const std::string& gap, const std::string& stiction, double size,
                        std::int64_t now_ms) {
    AlarmReading first = reading("F", gap);
    first.key.second = "model_gap";
    first.severity_percent.reset();
    AlarmReading second = reading("F", stiction, size, stiction == "normal" ? 0 : 1);
    first.incident = second.incident = "F-20261124T145805Z";
    const std::array readings{first, second};
    const Step step = all.rules.read(readings, {}, now_ms);
    all.rules.accept(step);
    return told(step);
  };
  CHECK(read("unacknowledged", "normal", 0.0, kStart) == "mail:came");
  // A channel without the first alarm receives the second.
  CHECK(read("unacknowledged", "unacknowledged", 12.0, kStart + 5 * kMinute) == "sms:came");
  // Two alarms wait. The reminder is for the one that has waited longer.
  CHECK(read("unacknowledged", "unacknowledged", 12.0, kStart + 10 * kMinute) ==
        "phone:unacknowledged");
  CHECK(read("unacknowledged", "unacknowledged", 12.0, kStart + 16 * kMinute).empty());
  // The incident is acknowledged or cleared when all its alarms are. A reminder is for the alarm
  // that still waits.
  CHECK(read("acknowledged", "unacknowledged", 12.0, kStart + 17 * kMinute) ==
        "phone:unacknowledged");
  CHECK(read("acknowledged", "acknowledged", 12.0, kStart + 18 * kMinute) == "mail:acknowledged");
  CHECK(read("normal", "acknowledged", 12.0, kStart + 19 * kMinute).empty());
  CHECK(read("normal", "normal", 12.0, kStart + 20 * kMinute) == "mail:went sms:went");
}

TEST_CASE("a step that was not stored is repeated", "[notify][changes]") {
  Rules all;
  all.settings.routes = {route({"mail"})};
  const AlarmReading on = reading("F", "unacknowledged");
  CHECK(told(all.rules.read(std::span(&on, 1), {}, kStart)) == "mail:came");
  CHECK(all.read(on, kStart + 1000) == "mail:came");
  CHECK(all.read(on, kStart + 2000).empty());
}

}  // namespace watch_rules_test
