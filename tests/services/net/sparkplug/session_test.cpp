// SPDX-License-Identifier: Apache-2.0
// The specification's rules for an edge node. Rules for a host:
// tests/services/net/sparkplug/edge_tracker_test.cpp.
#include <catch2/catch.hpp>
#include <cstdint>
#include <optional>

#include "services/net/sparkplug/edge_session.hpp"
#include "services/net/sparkplug/host_state.hpp"
#include "services/net/sparkplug/sequence.hpp"

namespace session_test {

using namespace loopwarden::sparkplug;
using Next = EdgeSession::Next;
using State = EdgeSession::State;

TEST_CASE("seq counts from 0 in a birth to 255 and again from 0", "[sparkplug]") {
  Sequence seq;
  CHECK(seq.restart() == 0);
  for (unsigned i = 1; i <= 255; ++i) REQUIRE(seq.next() == i);
  CHECK(seq.next() == 0);
  CHECK(seq.next() == 1);
  CHECK(seq.restart() == 0);
  CHECK(seq.next() == 1);
}

TEST_CASE("bdSeq counts connections from 0 to 255 and again from 0, over restarts", "[sparkplug]") {
  EdgeSession first(false, std::nullopt);
  CHECK(first.connecting() == 0);
  CHECK(first.connecting() == 1);
  EdgeSession later(false, std::uint8_t{255});
  CHECK(later.connecting() == 0);
  CHECK(later.bd_seq() == 0);
}

TEST_CASE("without a primary host births follow the connection", "[sparkplug]") {
  EdgeSession session(false, std::nullopt);
  session.connecting();
  CHECK_FALSE(session.live());
  CHECK(session.rebirth_asked() == Next::nothing);
  CHECK(session.connected() == Next::births);
  CHECK(session.live());
  CHECK(session.host_said({false, 5}) == Next::nothing);
  CHECK(session.rebirth_asked() == Next::births);
  CHECK(session.bd_seq() == 0);
  session.disconnected();
  CHECK(session.state() == State::offline);
}

TEST_CASE(
    "with a primary host births wait until it is online, and the edge disconnects when the host is "
    "offline",
    "[sparkplug]") {
  EdgeSession session(true, std::nullopt);
  session.connecting();
  CHECK(session.connected() == Next::nothing);
  CHECK(session.state() == State::waiting_for_host);
  CHECK(session.rebirth_asked() == Next::nothing);
  CHECK(session.host_said({false, 1}) == Next::nothing);
  CHECK(session.host_said({true, 2}) == Next::births);
  CHECK(session.live());
  CHECK(session.host_said({true, 3}) == Next::nothing);
  // The will of the earlier connection is older than the present STATE.
  CHECK(session.host_said({false, 2}) == Next::nothing);
  CHECK(session.live());
  CHECK(session.host_said({false, 3}) == Next::leave);
  CHECK_FALSE(session.live());
  // The next connection receives the retained STATE again, with the same time.
  CHECK(session.connecting() == 1);
  CHECK(session.connected() == Next::nothing);
  CHECK(session.host_said({false, 3}) == Next::nothing);
  CHECK(session.host_said({true, 4}) == Next::births);
}

TEST_CASE("a host's STATE may arrive before the subscription is granted", "[sparkplug]") {
  EdgeSession session(true, std::nullopt);
  session.connecting();
  CHECK(session.host_said({true, 1}) == Next::nothing);
  CHECK_FALSE(session.live());
  CHECK(session.connected() == Next::births);
  session.disconnected();
  // The STATE was received on an older connection, and must be received again.
  session.connecting();
  CHECK(session.connected() == Next::nothing);
}

TEST_CASE("a host's STATE is an object with online and timestamp", "[sparkplug]") {
  CHECK(to_text(HostState{true, 7}) == R"({"online":true,"timestamp":7})");
  CHECK(parse_host_state(R"({"online":false,"timestamp":7})") == HostState{false, 7});
  for (const char* text :
       {"", "ONLINE", "[]", "{}", R"({"online":1,"timestamp":7})", R"({"online":true})",
        R"({"online":true,"timestamp":-1})", R"({"online":true,"timestamp":"7"})",
        // After such a time no later one can follow.
        R"({"online":false,"timestamp":18446744073709551615})",
        R"({"online":false,"timestamp":4102444800000})"}) {
    INFO(text);
    CHECK_FALSE(parse_host_state(text));
  }
}

}  // namespace session_test
