// SPDX-License-Identifier: Apache-2.0
#include "services/net/sparkplug/edge_tracker.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "services/net/sparkplug/edge_session.hpp"
#include "tests/support/property.hpp"

namespace loopwarden::edge_tracker_test {
namespace {

using sparkplug::EdgeTracker;
using sparkplug::Message;
using sparkplug::MessageType;
using sparkplug::Verdict;
namespace property = tests::property;

Message data(std::uint64_t seq, std::uint64_t time_ms) {
  Message message;
  message.topic = {"A", MessageType::ddata, "box", "FIC-101"};
  message.payload.seq = seq;
  message.payload.time_ms = time_ms;
  return message;
}

Message with_bd_seq(MessageType type, std::uint64_t bd_seq, std::uint64_t time_ms) {
  Message message;
  message.topic = {"A", type, "box", ""};
  message.payload.time_ms = time_ms;
  sparkplug::Metric metric;
  metric.name = "bdSeq";
  metric.value = bd_seq;
  message.payload.metrics.push_back(metric);
  if (type == MessageType::nbirth) message.payload.seq = 0;
  return message;
}

struct Feed {
  EdgeTracker tracker;
  std::vector<Message> ready;
  std::int64_t now_ms = 0;

  Verdict take(Message message) { return tracker.take(std::move(message), now_ms, ready); }
  std::vector<std::uint64_t> times() const {
    std::vector<std::uint64_t> times;
    for (const Message& message : ready) times.push_back(*message.payload.time_ms);
    return times;
  }
};

Feed born() {
  Feed feed;
  REQUIRE(feed.take(with_bd_seq(MessageType::nbirth, 7, 1)) == Verdict::taken);
  return feed;
}

TEST_CASE("data before a birth are dropped and request a rebirth, and after the birth no more") {
  Feed feed;
  CHECK(feed.take(data(5, 100)) == Verdict::unborn);
  CHECK(feed.ready.empty());
  CHECK(feed.tracker.wants_rebirth());
  CHECK(feed.take(with_bd_seq(MessageType::nbirth, 3, 200)) == Verdict::taken);
  CHECK_FALSE(feed.tracker.wants_rebirth());
  CHECK(feed.take(data(1, 300)) == Verdict::taken);
}

TEST_CASE("a message after a gap waits for the missing ones") {
  Feed feed = born();
  CHECK(feed.take(data(2, 12)) == Verdict::held);
  CHECK(feed.take(data(3, 13)) == Verdict::held);
  CHECK(feed.times() == std::vector<std::uint64_t>{1});
  CHECK(feed.take(data(1, 11)) == Verdict::taken);
  CHECK(feed.times() == std::vector<std::uint64_t>{1, 11, 12, 13});
  CHECK_FALSE(feed.tracker.wants_rebirth());
  CHECK_FALSE(feed.tracker.waits());
}

TEST_CASE("after the reorder timeout a gap counts as lost, and a rebirth is requested") {
  Feed feed = born();
  CHECK(feed.take(data(3, 13)) == Verdict::held);
  CHECK_FALSE(feed.tracker.give_up_late(1999, feed.ready));
  CHECK(feed.tracker.give_up_late(2000, feed.ready));
  CHECK(feed.times() == std::vector<std::uint64_t>{1, 13});
  CHECK(feed.tracker.wants_rebirth());
  CHECK(feed.tracker.missing() == 2);
  // A late message is not lost.
  CHECK(feed.take(data(1, 11)) == Verdict::late);
  CHECK(feed.take(data(4, 14)) == Verdict::taken);
}

TEST_CASE("a clock that is set back ends the wait for a gap") {
  Feed feed = born();
  feed.now_ms = 1'000'000;
  CHECK(feed.take(data(3, 13)) == Verdict::held);
  CHECK(feed.tracker.give_up_late(0, feed.ready));
}

TEST_CASE("a full window ends the wait for a gap at once, as does a far jump") {
  Feed feed = born();
  for (std::uint64_t seq = 2; seq < 18; ++seq) feed.take(data(seq, 10 + seq));
  CHECK(feed.ready.size() == 17);
  CHECK(feed.tracker.missing() == 1);
  Feed jumping = born();
  CHECK(jumping.take(data(100, 500)) == Verdict::taken);
  CHECK(jumping.tracker.missing() == 99);
  CHECK(jumping.tracker.wants_rebirth());
}

TEST_CASE("a repeated message is dropped; a different one with its number is a conflict") {
  Feed feed = born();
  feed.take(data(1, 11));
  feed.take(data(2, 12));
  CHECK(feed.take(data(1, 11)) == Verdict::duplicate);
  CHECK(feed.tracker.conflicts() == 0);
  CHECK(feed.take(data(2, 99)) == Verdict::late);
  CHECK(feed.tracker.conflicts() == 1);
}

TEST_CASE("the will of an older connection doesn't end a newer one") {
  Feed feed = born();
  CHECK(feed.take(with_bd_seq(MessageType::ndeath, 6, 5)) == Verdict::old_death);
  CHECK(feed.tracker.born());
  CHECK(feed.take(with_bd_seq(MessageType::ndeath, 7, 6)) == Verdict::taken);
  CHECK_FALSE(feed.tracker.born());
  // The will arrives after the edge's own death.
  CHECK(feed.take(with_bd_seq(MessageType::ndeath, 7, 6)) == Verdict::duplicate);
  CHECK_FALSE(feed.tracker.wants_rebirth());
}

TEST_CASE(
    "a death with an unreadable bdSeq ends the present connection, and a rebirth is requested") {
  const auto death = [](std::vector<sparkplug::Metric> metrics) {
    Message message = with_bd_seq(MessageType::ndeath, 7, 6);
    message.payload.metrics = std::move(metrics);
    return message;
  };
  const auto bd_seq = [](sparkplug::Value value) {
    sparkplug::Metric metric;
    metric.name = "bdSeq";
    metric.value = std::move(value);
    return metric;
  };
  sparkplug::Metric nameless = bd_seq(std::uint64_t{7});
  nameless.name.clear();
  nameless.alias = 9;
  const std::vector<std::vector<sparkplug::Metric>> unreadable{
      {},
      {nameless},  // the birth gave it no alias
      {bd_seq(std::string("7"))},
      {bd_seq(7.0)},
      {bd_seq(true)},
      {bd_seq(std::monostate())},
      {bd_seq(std::uint64_t{256})},
      {bd_seq(std::int64_t{-1})}};
  for (const auto& metrics : unreadable) {
    Feed feed = born();
    CHECK(feed.take(death(metrics)) == Verdict::unmatched_death);
    CHECK(feed.ready.size() == 2);
    CHECK_FALSE(feed.tracker.born());
    CHECK(feed.tracker.wants_rebirth());
    CHECK(feed.take(data(1, 11)) == Verdict::unborn);
    CHECK(feed.take(with_bd_seq(MessageType::nbirth, 7, 20)) == Verdict::taken);
    CHECK(feed.tracker.born());
  }
}

TEST_CASE("a death can name bdSeq by the alias of the birth") {
  Message birth = with_bd_seq(MessageType::nbirth, 7, 1);
  birth.payload.metrics[0].alias = 9;
  const auto death = [](std::uint64_t bd_seq) {
    Message message = with_bd_seq(MessageType::ndeath, bd_seq, 6);
    message.payload.metrics[0].name.clear();
    message.payload.metrics[0].alias = 9;
    return message;
  };
  Feed feed;
  REQUIRE(feed.take(birth) == Verdict::taken);
  CHECK(feed.take(death(6)) == Verdict::old_death);
  CHECK(feed.tracker.born());
  CHECK(feed.take(death(7)) == Verdict::taken);
  CHECK_FALSE(feed.tracker.born());
}

TEST_CASE("a birth without seq 0 or bdSeq is invalid") {
  Feed feed;
  Message without = with_bd_seq(MessageType::nbirth, 1, 1);
  without.payload.metrics.clear();
  CHECK(feed.take(without) == Verdict::malformed);
  Message other_seq = with_bd_seq(MessageType::nbirth, 1, 1);
  other_seq.payload.seq = 4;
  CHECK(feed.take(other_seq) == Verdict::malformed);
  CHECK(feed.tracker.wants_rebirth());
  Message huge = with_bd_seq(MessageType::nbirth, 256, 1);
  CHECK(feed.take(huge) == Verdict::malformed);
}

TEST_CASE("a resumed tracker continues after the position in the database") {
  Feed feed;
  feed.tracker.resume(9, 254);
  CHECK(feed.take(data(255, 20)) == Verdict::taken);
  CHECK(feed.take(data(0, 21)) == Verdict::taken);
  // The message is read from the spool again. The keys of the tables show this.
  CHECK(feed.take(data(254, 19)) == Verdict::late);
}

// Permitted changes by a broker to the messages of one connection within the window: it delays some
// and delivers some twice.
TEST_CASE("messages swapped or doubled within the window are returned once and in order") {
  property::for_all("order", 300, [] {
    const auto count = static_cast<std::size_t>(property::integer(1, 600));
    std::vector<std::uint64_t> order(count);
    for (std::size_t i = 0; i < count; ++i) order[i] = i + 1;
    for (std::size_t i = 0; i + 1 < count; ++i) {
      const auto other = std::min(count - 1, i + property::one_of(6));
      if (property::coin() && other < i / 8 * 8 + 8) std::swap(order[i], order[other]);
    }
    Feed feed = born();
    for (const std::uint64_t n : order) {
      feed.take(data(n % 256, 100 + n));
      if (property::one_of(10) == 0) feed.take(data(n % 256, 100 + n));
    }
    std::vector<std::uint64_t> expected{1};
    for (std::size_t i = 0; i < count; ++i) expected.push_back(101 + i);
    property::require(feed.times() == expected, "each once, in order");
    property::require(!feed.tracker.wants_rebirth(), "nothing is missing");
  });
}

TEST_CASE("after any losses no message is returned twice, and a loss is noticed") {
  property::for_all("losses", 300, [] {
    Feed feed = born();
    std::uint64_t lost = 0;
    const auto count = static_cast<std::uint64_t>(property::integer(1, 400));
    for (std::uint64_t n = 1; n <= count; ++n) {
      feed.now_ms += property::integer(0, 400);
      feed.tracker.give_up_late(feed.now_ms, feed.ready);
      if (property::one_of(20) == 0 && n < count) {
        ++lost;
      } else {
        feed.take(data(n % 256, 100 + n));
      }
    }
    feed.tracker.give_up_late(feed.now_ms + 10'000, feed.ready);
    const std::vector<std::uint64_t> times = feed.times();
    const std::set<std::uint64_t> different(times.begin(), times.end());
    property::require(different.size() == times.size(), "none twice");
    property::require(times.size() == count + 1 - lost, "all that came");
    property::require(feed.tracker.missing() == lost, "each loss counted");
    property::require(feed.tracker.wants_rebirth() == (lost > 0),
                      "a rebirth is requested exactly after a loss");
  });
}

TEST_CASE("a host that receives every message never misses one") {
  using sparkplug::EdgeSession;
  property::for_all("no gap", 200, [] {
    EdgeSession edge(property::coin(), static_cast<std::uint8_t>(property::integer(0, 255)));
    Feed host;
    std::uint64_t time = 1;
    const auto say = [&](Message message) {
      const Verdict verdict = host.take(std::move(message));
      property::require(verdict == Verdict::taken && !host.tracker.wants_rebirth(), "in order");
    };
    const auto births = [&](EdgeSession::Next next) {
      if (next != EdgeSession::Next::births) return;
      Message birth = with_bd_seq(MessageType::nbirth, edge.bd_seq(), ++time);
      birth.payload.seq = edge.birth_seq();
      say(std::move(birth));
      say(data(edge.next_seq(), ++time));
    };
    for (int step = 0; step < 400; ++step) {
      switch (property::one_of(6)) {
        case 0:
          edge.disconnected();
          if (host.tracker.born()) {
            say(with_bd_seq(MessageType::ndeath, *host.tracker.bd_seq(), ++time));
          }
          edge.connecting();
          births(edge.connected());
          break;
        case 1: births(edge.host_said({property::coin(), ++time})); break;
        case 2: births(edge.rebirth_asked()); break;
        default:
          if (edge.live()) say(data(edge.next_seq(), ++time));
      }
    }
  });
}

// Two edge nodes with one name, and garbage in seq and bdSeq. Only the received messages may be
// returned.
TEST_CASE("arbitrary messages are never returned more often than they were received") {
  property::for_all("garbage", 500, [] {
    Feed feed;
    std::size_t in = 0;
    const auto count = static_cast<std::size_t>(property::integer(1, 200));
    for (std::size_t i = 0; i < count; ++i, ++in) {
      const std::uint64_t number = property::coin() ? property::bits() : property::bits() % 256;
      const std::uint64_t time = property::bits() % 50;
      switch (property::one_of(4)) {
        case 0: feed.take(with_bd_seq(MessageType::nbirth, number, time)); break;
        case 1: feed.take(with_bd_seq(MessageType::ndeath, number % 4, time)); break;
        default: feed.take(data(number, time)); break;
      }
      feed.now_ms += property::integer(-5000, 5000);
      feed.tracker.give_up_late(feed.now_ms, feed.ready);
    }
    property::require(feed.ready.size() <= in, "no more out than in");
  });
}

}  // namespace
}  // namespace loopwarden::edge_tracker_test
