// SPDX-License-Identifier: Apache-2.0
#include "services/notify/rules/dispatch.hpp"

#include "tests/services/notify/notify_support.hpp"

namespace dispatch_test {

using namespace loopwarden::notify;
using namespace loopwarden::notify::test;

namespace {

std::vector<Waiting> waiting(std::initializer_list<std::int64_t> since_ms) {
  std::vector<Waiting> all;
  for (const std::int64_t at : since_ms) {
    all.push_back({static_cast<std::int64_t>(all.size() + 1), at, event_of("F")});
  }
  return all;
}

}  // namespace

TEST_CASE("events within the grouping time are sent together", "[notify][dispatch]") {
  const ChannelRule mail{.name = "mail", .group_ms = 30'000, .most_per_hour = 20};
  const auto all = waiting({kNoon, kNoon + 10'000, kNoon + 29'000});
  CHECK(ready(mail, {}, all, {}, kNoon + 29'999).empty());
  CHECK(ready(mail, {}, all, {}, kNoon + 30'000) == std::vector<std::size_t>{0, 1, 2});
  // A clock that was set back delays no event.
  CHECK(ready(mail, {}, all, {}, kNoon - 3'600'000).size() == 3);
  CHECK(ready(mail, {}, {}, {}, kNoon).empty());
}

TEST_CASE("the number of messages per hour is bounded", "[notify][dispatch]") {
  const ChannelRule mail{.name = "mail", .group_ms = 0, .most_per_hour = 2};
  const auto all = waiting({kNoon});
  const std::vector<std::int64_t> made{kNoon - 3'600'000, kNoon - 100'000, kNoon - 10};
  CHECK(ready(mail, {}, all, made, kNoon).empty());
  CHECK(ready(mail, {}, all, made, kNoon + 3'500'000).size() == 1);
  // The clock was set back after these events.
  const std::vector<std::int64_t> ahead{kNoon + 7'200'000, kNoon + 7'200'001};
  CHECK(ready(mail, {}, all, ahead, kNoon).size() == 1);
  const ChannelRule log{.name = "log", .group_ms = 0, .most_per_hour = 2, .one_each = true};
  CHECK(ready(log, {}, waiting({kNoon, kNoon, kNoon}), {}, kNoon).size() == 2);
}

TEST_CASE("events of low priority wait for the digest, at its local time", "[notify][dispatch]") {
  constexpr std::int64_t kHour = 3'600'000;
  ChannelRule mail{.name = "mail", .group_ms = 0, .most_per_hour = 20};
  mail.digest_min = 7 * 60;
  mail.zone = find_zone("Europe/Berlin");  // noon UTC is 13:00
  auto all = waiting({kNoon, kNoon, kNoon + kHour});
  all[0].event.priority = all[2].event.priority = "low";
  all[1].event.priority = "medium";
  CHECK(ready(mail, {}, all, {}, kNoon + kHour) == std::vector<std::size_t>{1});
  all.erase(all.begin() + 1);
  CHECK(ready(mail, {}, all, {}, kNoon + 18 * kHour - 1).empty());
  CHECK(ready(mail, {}, all, {}, kNoon + 18 * kHour).size() == 2);
  CHECK(ready(mail, {}, all, {}, kNoon + 30 * kHour).size() == 2);
  // A clock that was set back delays no event.
  CHECK(ready(mail, {}, all, {}, kNoon - kHour).size() == 2);
}

TEST_CASE(
    "events held by quiet hours leave at their end, in one message; severe events leave at once",
    "[notify][dispatch]") {
  QuietHours night;
  night.channels = {"mail"};
  night.zone = find_zone("UTC");
  night.from_min = 12 * 60;
  night.to_min = 13 * 60;
  night.override_severity_percent = 10.0;
  const ChannelRule mail{.name = "mail", .group_ms = 30'000, .most_per_hour = 20};
  auto all = waiting({kNoon, kNoon + 60'000, kNoon + 120'000});
  all[1].event.worst_percent = 12.0;
  CHECK(ready(mail, {night}, all, {}, kNoon + 600'000) == std::vector<std::size_t>{1});
  all.erase(all.begin() + 1);
  CHECK(ready(mail, {night}, all, {}, kNoon + 3'599'999).empty());
  CHECK(ready(mail, {night}, all, {}, kNoon + 3'600'000).size() == 2);
}

TEST_CASE("a flood is one message that counts the unlisted events", "[notify][dispatch]") {
  std::vector<Event> events(5000, event_of("F"));
  for (std::size_t i = 0; i < 1000; ++i) events[i].change = Change::went;
  const Message message = message_of("mail", events, kNoon);
  CHECK(message.events.size() == kMostListed);
  CHECK(message.count() == 5000);
  CHECK(headline(message, sender()) == "[box 12] 5000 alarm changes: 4000 new, 1000 cleared");
  CHECK(letter(message, sender()).find("... and 4900 more") != std::string::npos);
}

}  // namespace dispatch_test
