// SPDX-License-Identifier: Apache-2.0
#include "net/http/event_board.hpp"

#include <catch2/catch.hpp>

namespace loopwarden::tests::event_board_test {

using namespace http;

TEST_CASE("a client that does not keep up skips to the newest") {
  EventBoard board;
  EventBoard::Cursor cursor = board.newcomer();
  for (int i = 0; i < 1000; ++i)
    board.publish(EventKind::overview, "{\"n\":" + std::to_string(i) + "}");
  const auto frames = board.news(cursor);
  REQUIRE(frames.size() == 1);
  CHECK(*frames[0] == "event: overview\ndata: {\"n\":999}\n\n");
  CHECK(board.news(cursor).empty());
}

TEST_CASE("who comes gets the state and no old change of the description") {
  EventBoard board;
  board.publish(EventKind::daemon, "{\"up\":true}");
  board.publish(EventKind::describe, "{}");
  board.publish(EventKind::alarms, "[]");
  EventBoard::Cursor cursor = board.newcomer();
  const auto frames = board.news(cursor);
  REQUIRE(frames.size() == 2);
  CHECK(*frames[0] == "event: daemon\ndata: {\"up\":true}\n\n");
  CHECK(*frames[1] == "event: alarms\ndata: []\n\n");
  board.publish(EventKind::describe, "{}");
  CHECK(board.news(cursor).size() == 1);
}

}  // namespace loopwarden::tests::event_board_test
