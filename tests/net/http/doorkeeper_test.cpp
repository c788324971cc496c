// SPDX-License-Identifier: Apache-2.0
#include "net/http/doorkeeper.hpp"

#include <catch2/catch.hpp>

namespace loopwarden::tests::doorkeeper_test {

using namespace http;
using std::chrono::seconds;

const Moment kStart{};

TEST_CASE("where all places are taken who never asked goes first, the oldest") {
  Doorkeeper door({.clients = 3, .per_address = 3});
  const auto asked = door.admit("10.0.0.1", false, kStart).id;
  const auto silent = door.admit("10.0.0.2", false, kStart).id;
  door.admit("10.0.0.3", false, kStart + seconds(1));
  door.busy(asked);
  door.idle(asked, kStart);
  const auto newcomer = door.admit("10.0.0.4", false, kStart + seconds(2));
  CHECK(newcomer.id != 0);
  CHECK(newcomer.displaced == silent);
  CHECK(door.clients() == 3);
}

TEST_CASE("then who has been silent for longest, and nobody who is being answered") {
  Doorkeeper door({.clients = 2, .per_address = 2});
  const auto early = door.admit("10.0.0.1", false, kStart).id;
  const auto late = door.admit("10.0.0.2", false, kStart).id;
  for (const auto id : {early, late}) door.busy(id);
  CHECK(door.admit("10.0.0.3", false, kStart).id == 0);
  CHECK(door.turned_away() == 1);
  door.idle(late, kStart + seconds(5));
  door.idle(early, kStart + seconds(6));
  CHECK(door.admit("10.0.0.3", false, kStart + seconds(7)).displaced == late);
}

TEST_CASE("one address has a part of the places, this host a greater one") {
  Doorkeeper door({.clients = 10, .per_address = 2, .loopback = 5});
  const auto first = door.admit("10.0.0.1", false, kStart).id;
  door.admit("10.0.0.1", false, kStart);
  door.admit("10.0.0.2", false, kStart);
  CHECK(door.admit("10.0.0.1", false, kStart).displaced == first);
  const auto local = door.admit("loopback", true, kStart).id;
  for (int i = 0; i < 4; ++i) CHECK_FALSE(door.admit("loopback", true, kStart).displaced);
  CHECK(door.admit("loopback", true, kStart).displaced == local);
}

TEST_CASE("streams leave places, in all and of one address") {
  Doorkeeper door({.clients = 12, .per_address = 4, .loopback = 8});
  const auto streams = [&](const std::string& address, bool loopback, int tries) {
    int taken = 0;
    for (int i = 0; i < tries; ++i) {
      const auto id = door.admit(address, loopback, kStart).id;
      door.busy(id);
      if (door.stream(id)) {
        ++taken;
      } else {
        door.left(id);
      }
    }
    return taken;
  };
  CHECK(streams("10.0.0.1", false, 4) == 3);
  CHECK(streams("loopback", true, 8) == 6);
  CHECK(streams("10.0.0.2", false, 1) == 0);
  CHECK(door.admit("10.0.0.1", false, kStart).id != 0);
}

TEST_CASE("a stream that has gone makes room for another") {
  Doorkeeper door({.clients = 4, .per_address = 2});
  const auto first = door.admit("10.0.0.1", false, kStart).id;
  const auto second = door.admit("10.0.0.1", false, kStart).id;
  CHECK(door.stream(first));
  CHECK_FALSE(door.stream(second));
  door.left(first);
  CHECK(door.stream(second));
}

TEST_CASE("an address asks in bursts, and then at its rate") {
  Doorkeeper door({.requests_per_s = 5.0});
  for (int i = 0; i < 20; ++i) CHECK(door.wait_s("10.0.0.1", kStart) == 0);
  CHECK(door.wait_s("10.0.0.1", kStart) >= 1);
  CHECK(door.wait_s("10.0.0.2", kStart) == 0);
  CHECK(door.wait_s("10.0.0.1", kStart + seconds(1)) == 0);
}

TEST_CASE("what is kept of addresses is bounded") {
  Doorkeeper door({.requests_per_s = 1.0});
  for (int i = 0; i < 100'000; ++i) door.wait_s("10.0.0." + std::to_string(i), kStart);
  CHECK(door.wait_s("10.9.9.9", kStart) == 0);
}

}  // namespace loopwarden::tests::doorkeeper_test
