// SPDX-License-Identifier: Apache-2.0
#include "daemon/loops/commissioning.hpp"

#include <catch2/catch.hpp>
#include <chrono>
#include <cstdint>
#include <optional>

#include "daemon/protocol/requests.hpp"

namespace loopwarden::daemon::loop_commissioning_test {

TEST_CASE("a sign of life is a command, or only the session") {
  rt::LoopChannels channels({});
  Commissioning loop(channels);
  const auto start = Commissioning::Clock::now();
  const auto at = [&](int seconds) { return start + std::chrono::seconds(seconds); };
  const std::uint64_t session = loop.take(std::nullopt, "uid 0", 17, at(0));
  loop.check_command(session, at(50));
  loop.take(session, "uid 0", 18, at(100));
  CHECK(channels.commissioned);
  CHECK_FALSE(loop.silent(at(159)));
  CHECK(loop.holder(at(159))->ends_in_s == Approx(1.0));
  CHECK(loop.holder(at(159))->since_ms == 17);
  CHECK(loop.silent(at(161)));
  CHECK_THROWS_AS(loop.take(session, "uid 0", 19, at(162)), protocol::RequestError);
  CHECK_THROWS_AS(loop.check_command(session, at(162)), protocol::RequestError);
  // Its session has expired, but the loop is not released yet.
  CHECK_THROWS_AS(loop.take(std::nullopt, "uid 7", 19, at(163)), protocol::RequestError);
  CHECK(channels.commissioned);
  channels.withheld_until_ns = INT64_MAX;
  CHECK(loop.give_back());
  CHECK_FALSE(channels.commissioned);
  CHECK(channels.withheld_until_ns == 0);
  CHECK(loop.take(std::nullopt, "uid 7", 20, at(164)) != session);
}

}  // namespace loopwarden::daemon::loop_commissioning_test
