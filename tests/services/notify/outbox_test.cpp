// SPDX-License-Identifier: Apache-2.0
#include "services/notify/store/outbox.hpp"

#include "tests/services/notify/notify_support.hpp"

namespace outbox_test {

using namespace loopwarden::notify;
using namespace loopwarden::notify::test;

namespace {

struct Store {
  TemporaryFolder folder;
  std::string file = (folder / "n.sqlite").string();
};

Step step_of(const std::string& channel, std::size_t count) {
  Step step;
  for (std::size_t i = 0; i < count; ++i) {
    step.posts.push_back({channel, event_of("F" + std::to_string(i))});
  }
  return step;
}

// Posts an event and makes a message of it.
void make_message(Outbox& outbox, const std::string& channel) {
  const auto added = outbox.post(step_of(channel, 1), kNoon);
  const Waiting& one = added.at(channel).front();
  const Message message = message_of(channel, std::span(&one.event, 1), kNoon);
  outbox.queue(std::span(&message, 1), std::span(&one.id, 1));
}

Attempt attempt(const Message& message, MessageState state, std::int64_t again_ms = 0) {
  return {.id = message.id, .state = state, .at_ms = kNoon, .again_ms = again_ms, .result = "r"};
}

}  // namespace

TEST_CASE("a row that can't be read fails separately, and the channel continues",
          "[notify][store]") {
  const Store store;
  {
    Outbox outbox(store.file);
    make_message(outbox, "mail");
    make_message(outbox, "mail");
    outbox.post(step_of("mail", 2), kNoon);
  }
  {
    loopwarden::sqlite::Database damaged(store.file, loopwarden::sqlite::Access::write,
                                         std::chrono::seconds(1));
    damaged.execute("UPDATE message SET content = '{\"events\": 7' WHERE id = 1");
    damaged.execute("UPDATE waiting SET event = 'x' WHERE id = (SELECT min(id) FROM waiting)");
  }
  Outbox outbox(store.file);
  const auto waiting = outbox.waiting("mail");
  REQUIRE(waiting.size() == 1);
  CHECK(waiting[0].event.loop == "F1");
  const auto message = outbox.next("mail", kNoon, std::nullopt);
  REQUIRE(message);
  CHECK(message->id == 2);
  const std::vector<MessageRow> rows = outbox.newest(10);
  REQUIRE(rows.size() == 2);
  CHECK(rows[1].state == MessageState::failed);
  CHECK_THAT(rows[1].result, Catch::Contains("can't be read"));
  // The next message reports that one event was lost.
  const Message next = message_of("mail", std::span(&waiting[0].event, 1), kNoon);
  outbox.queue(std::span(&next, 1), std::span(&waiting[0].id, 1));
  CHECK(outbox.newest(1).front().message.lost == 1);
}

TEST_CASE("notified alarms, waiting events and messages survive", "[notify][store]") {
  const Store store;
  {
    Outbox outbox(store.file);
    Step step = step_of("mail", 2);
    step.changed[{"F", "stiction"}] = {.state = "acknowledged",
                                       .unacknowledged = false,
                                       .times_raised = 3,
                                       .worst_percent = 7.5,
                                       .since_ms = 1,
                                       .reminded_ms = 2};
    step.changed[{"G", "unknown"}] = {.state = "unacknowledged", .unacknowledged = true};
    outbox.post(step, kNoon);
    make_message(outbox, "log");
  }
  Outbox outbox(store.file);
  const Pictures pictures = outbox.pictures();
  CHECK(pictures.size() == 2);
  CHECK(pictures.at({"F", "stiction"}).worst_percent == 7.5);
  CHECK(!pictures.at({"G", "unknown"}).worst_percent);
  const std::vector<Waiting> waiting = outbox.waiting("mail");
  REQUIRE(waiting.size() == 2);
  CHECK(waiting[1].event == event_of("F1"));
  CHECK(outbox.waiting("log").empty());
  CHECK(outbox.made_ms("log", 10) == std::vector<std::int64_t>{kNoon});
  CHECK(outbox.queued("log") == 1);
}

TEST_CASE("a message is returned once, in order, and again only for a retry", "[notify][store]") {
  const Store store;
  Outbox outbox(store.file);
  for (int i = 0; i < 3; ++i) make_message(outbox, "mail");
  const auto first = outbox.next("mail", kNoon, std::nullopt);
  REQUIRE(first);
  CHECK(first->attempts == 1);
  CHECK(!first->perhaps_twice);
  // A refused message delays the messages after it, so that alarms aren't reported as raised after
  // they cleared.
  CHECK(!outbox.next("mail", kNoon, attempt(*first, MessageState::queued, kNoon + 5000)));
  CHECK(outbox.due_ms("mail") == kNoon + 5000);
  const auto again = outbox.next("mail", kNoon + 5000, std::nullopt);
  REQUIRE(again);
  CHECK(again->id == first->id);
  CHECK(again->attempts == 2);
  const auto second = outbox.next("mail", kNoon, attempt(*again, MessageState::sent));
  REQUIRE(second);
  CHECK(second->id == first->id + 1);
  const auto third = outbox.next("mail", kNoon, attempt(*second, MessageState::failed));
  REQUIRE(third);
  CHECK(!outbox.next("mail", kNoon, attempt(*third, MessageState::sent)));
  CHECK(outbox.queued("mail") == 0);
  const std::vector<MessageRow> rows = outbox.newest(10);
  REQUIRE(rows.size() == 3);
  CHECK(rows[1].state == MessageState::failed);
  CHECK(rows[2].message.attempts == 2);
  CHECK(rows[2].result == "r");
}

TEST_CASE("a clock that was set back doesn't keep a message for a day", "[notify][store]") {
  const Store store;
  Outbox outbox(store.file);
  make_message(outbox, "mail");
  const auto first = outbox.next("mail", kNoon, std::nullopt);
  outbox.settle(attempt(*first, MessageState::queued, kNoon + 900'000));
  CHECK(!outbox.next("mail", kNoon, std::nullopt));
  CHECK(outbox.next("mail", kNoon - 86'400'000, std::nullopt));
}

TEST_CASE("a message under way when the program ended is marked as such", "[notify][store]") {
  const Store store;
  std::int64_t id = 0;
  {
    Outbox outbox(store.file);
    make_message(outbox, "mail");
    make_message(outbox, "mail");
    id = outbox.next("mail", kNoon, std::nullopt)->id;
  }
  Outbox outbox(store.file);
  const auto again = outbox.next("mail", kNoon, std::nullopt);
  REQUIRE(again);
  CHECK(again->id == id);
  CHECK(again->perhaps_twice);
  CHECK(!outbox.next("mail", kNoon, attempt(*again, MessageState::sent))->perhaps_twice);
}

TEST_CASE("a flood keeps the newest events and counts the rest", "[notify][store]") {
  const Store store;
  Outbox outbox(store.file);
  outbox.post(step_of("mail", Outbox::kMostWaiting), kNoon);
  const auto added = outbox.post(step_of("mail", 3), kNoon);
  const std::vector<Waiting> waiting = outbox.waiting("mail");
  REQUIRE(waiting.size() == Outbox::kMostWaiting);
  CHECK(waiting.back().id == added.at("mail").back().id);
  const Message message = message_of("mail", std::span(&waiting.front().event, 1), kNoon);
  outbox.queue(std::span(&message, 1), std::span(&waiting.front().id, 1));
  CHECK(outbox.next("mail", kNoon, std::nullopt)->lost == 3);
}

TEST_CASE("events for a removed channel are dropped", "[notify][store]") {
  const Store store;
  Outbox outbox(store.file);
  outbox.post(step_of("old", 2), kNoon);
  make_message(outbox, "old");
  make_message(outbox, "mail");
  outbox.give_up_others({"mail"});
  CHECK(outbox.waiting("old").empty());
  CHECK(!outbox.next("old", kNoon, std::nullopt));
  CHECK(outbox.next("mail", kNoon, std::nullopt));
  CHECK(outbox.newest(10).back().result == "the channel is no longer configured");
}

TEST_CASE("files of other programs are refused", "[notify][store]") {
  const Store store;
  write_file(store.file, std::string(5000, 'x'));
  CHECK_THROWS_AS(Outbox(store.file), loopwarden::sqlite::Error);
  CHECK_THROWS_AS(Outbox((store.folder / "no/such/folder/n.sqlite").string()),
                  loopwarden::sqlite::Error);
  CHECK_THROWS_AS(Outbox((store.folder / "none").string(), loopwarden::sqlite::Access::read),
                  loopwarden::sqlite::Error);
}

}  // namespace outbox_test
