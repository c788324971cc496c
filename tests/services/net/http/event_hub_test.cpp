// SPDX-License-Identifier: Apache-2.0
#include "services/net/http/event_hub.hpp"

#include <catch2/catch.hpp>

namespace loopwarden::tests::event_hub_test {

using namespace http;

TEST_CASE("a client that does not keep up skips to the newest") {
  EventHub hub;
  EventHub::Cursor cursor = hub.newcomer();
  for (int i = 0; i < 1000; ++i)
    hub.publish(EventKind::overview, "{\"n\":" + std::to_string(i) + "}");
  const auto frames = hub.news(cursor);
  REQUIRE(frames.size() == 1);
  CHECK(*frames[0] == "event: overview\ndata: {\"n\":999}\n\n");
  CHECK(hub.news(cursor).empty());
}

TEST_CASE("a new client receives the state and no old change of the description") {
  EventHub hub;
  hub.publish(EventKind::daemon, "{\"up\":true}");
  hub.publish(EventKind::describe, "{}");
  hub.publish(EventKind::alarms, "[]");
  EventHub::Cursor cursor = hub.newcomer();
  const auto frames = hub.news(cursor);
  REQUIRE(frames.size() == 2);
  CHECK(*frames[0] == "event: daemon\ndata: {\"up\":true}\n\n");
  CHECK(*frames[1] == "event: alarms\ndata: []\n\n");
  hub.publish(EventKind::describe, "{}");
  CHECK(hub.news(cursor).size() == 1);
}

}  // namespace loopwarden::tests::event_hub_test
