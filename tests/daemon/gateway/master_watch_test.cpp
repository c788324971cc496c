// SPDX-License-Identifier: Apache-2.0
#include "daemon/gateway/master_watch.hpp"

#include <catch2/catch.hpp>

namespace loopwarden::daemon::gateway::master_watch_test {
namespace {

using Event = MasterWatch::Event;
constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::int64_t kRound = kSecond / 10;

struct Rounds {
  explicit Rounds(const MasterHeartbeatSettings& settings) : watch(settings) {}

  // Makes a round, this long after the last one.
  Event step(std::int64_t after_ns, bool written, std::uint16_t value) {
    value_ = value;
    return watch.step(now_ns_ += after_ns, written, value);
  }
  // Makes rounds without a heartbeat; returns the first event, if there was one.
  Event silent_for(std::int64_t duration_ns) {
    Event first = Event::none;
    for (std::int64_t t = 0; t < duration_ns; t += kRound) {
      const Event event = step(kRound, false, value_);
      if (first == Event::none) first = event;
    }
    return first;
  }

  MasterWatch watch;

 private:
  std::int64_t now_ns_ = 100 * kSecond;
  std::uint16_t value_ = 0;
};

}  // namespace

TEST_CASE("a master that falls silent is lost once, and back once", "[gateway]") {
  Rounds rounds({.timeout_s = 3.0, .action = MasterLossAction::manual});
  CHECK(rounds.silent_for(100 * kSecond) == Event::none);  // never there: never lost
  CHECK(rounds.step(kRound, true, 0) == Event::none);
  CHECK(rounds.silent_for(2 * kSecond) == Event::none);
  CHECK(rounds.step(kRound, true, 1) == Event::none);
  CHECK(rounds.silent_for(3 * kSecond - kRound) == Event::none);
  CHECK(rounds.silent_for(kRound) == Event::lost);
  CHECK(rounds.watch.lost());
  CHECK(rounds.silent_for(kSecond) == Event::none);
  CHECK(rounds.step(kRound, true, 2) == Event::back);
  CHECK_FALSE(rounds.watch.lost());
  CHECK(rounds.silent_for(3 * kSecond) == Event::lost);
}

TEST_CASE("writing the same number again is no sign of life", "[gateway]") {
  Rounds rounds({.timeout_s = 3.0, .action = MasterLossAction::report});
  rounds.step(kRound, true, 5);
  rounds.silent_for(2 * kSecond);
  CHECK(rounds.step(kRound, true, 5) == Event::none);
  CHECK(rounds.silent_for(kSecond - kRound) == Event::lost);
  CHECK(rounds.step(kRound, true, 5) == Event::none);
}

TEST_CASE("a pause of the server is no silence of the master", "[gateway]") {
  Rounds rounds({.timeout_s = 3.0, .action = MasterLossAction::manual});
  rounds.step(kRound, true, 1);
  rounds.silent_for(2 * kSecond);
  CHECK(rounds.step(15 * kSecond, false, 1) == Event::none);
  CHECK(rounds.step(kRound, true, 2) == Event::none);  // the message had waited in the socket
  CHECK_FALSE(rounds.watch.lost());

  // Even with little time left, the round after the pause judges no master. The next round does.
  rounds.silent_for(3 * kSecond - kRound);
  CHECK(rounds.step(15 * kSecond, false, 2) == Event::none);
  CHECK(rounds.step(kRound, false, 2) == Event::lost);
}

TEST_CASE("the master is watched even if every round is late", "[gateway]") {
  Rounds rounds({.timeout_s = 3.0, .action = MasterLossAction::manual});
  rounds.step(kRound, true, 1);
  Event event = Event::none;
  for (int i = 0; i < 12 && event == Event::none; ++i) event = rounds.step(kSecond, false, 1);
  CHECK(event == Event::lost);
}

TEST_CASE("without a timeout no master is watched", "[gateway]") {
  MasterWatch watch({});
  watch.step(0, true, 1);
  CHECK(watch.step(1'000'000 * kSecond, false, 1) == Event::none);
}

}  // namespace loopwarden::daemon::gateway::master_watch_test
