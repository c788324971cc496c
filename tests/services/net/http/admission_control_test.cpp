// SPDX-License-Identifier: Apache-2.0
#include "services/net/http/admission_control.hpp"

#include <catch2/catch.hpp>

namespace loopwarden::tests::admission_control_test {

using namespace http;
using std::chrono::seconds;

const Moment kStart{};

TEST_CASE("if all places are taken, the oldest client without a request is dropped first") {
  AdmissionControl admission({.clients = 3, .per_address = 3});
  const auto asked = admission.admit("10.0.0.1", false, kStart).id;
  const auto silent = admission.admit("10.0.0.2", false, kStart).id;
  admission.admit("10.0.0.3", false, kStart + seconds(1));
  admission.busy(asked);
  admission.idle(asked, kStart);
  const auto newcomer = admission.admit("10.0.0.4", false, kStart + seconds(2));
  CHECK(newcomer.id != 0);
  CHECK(newcomer.displaced == silent);
  CHECK(admission.clients() == 3);
}

TEST_CASE(
    "then the client that was silent for longest is dropped, never one that is being answered") {
  AdmissionControl admission({.clients = 2, .per_address = 2});
  const auto early = admission.admit("10.0.0.1", false, kStart).id;
  const auto late = admission.admit("10.0.0.2", false, kStart).id;
  for (const auto id : {early, late}) admission.busy(id);
  CHECK(admission.admit("10.0.0.3", false, kStart).id == 0);
  CHECK(admission.turned_away() == 1);
  admission.idle(late, kStart + seconds(5));
  admission.idle(early, kStart + seconds(6));
  CHECK(admission.admit("10.0.0.3", false, kStart + seconds(7)).displaced == late);
}

TEST_CASE("one address can take a part of the places, and this host a greater part") {
  AdmissionControl admission({.clients = 10, .per_address = 2, .loopback = 5});
  const auto first = admission.admit("10.0.0.1", false, kStart).id;
  admission.admit("10.0.0.1", false, kStart);
  admission.admit("10.0.0.2", false, kStart);
  CHECK(admission.admit("10.0.0.1", false, kStart).displaced == first);
  const auto local = admission.admit("loopback", true, kStart).id;
  for (int i = 0; i < 4; ++i) CHECK_FALSE(admission.admit("loopback", true, kStart).displaced);
  CHECK(admission.admit("loopback", true, kStart).displaced == local);
}

TEST_CASE("streams leave places free, in total and per address") {
  AdmissionControl admission({.clients = 12, .per_address = 4, .loopback = 8});
  const auto streams = [&](const std::string& address, bool loopback, int tries) {
    int taken = 0;
    for (int i = 0; i < tries; ++i) {
      const auto id = admission.admit(address, loopback, kStart).id;
      admission.busy(id);
      if (admission.stream(id)) {
        ++taken;
      } else {
        admission.left(id);
      }
    }
    return taken;
  };
  CHECK(streams("10.0.0.1", false, 4) == 3);
  CHECK(streams("loopback", true, 8) == 6);
  CHECK(streams("10.0.0.2", false, 1) == 0);
  CHECK(admission.admit("10.0.0.1", false, kStart).id != 0);
}

TEST_CASE("a closed stream makes room for another") {
  AdmissionControl admission({.clients = 4, .per_address = 2});
  const auto first = admission.admit("10.0.0.1", false, kStart).id;
  const auto second = admission.admit("10.0.0.1", false, kStart).id;
  CHECK(admission.stream(first));
  CHECK_FALSE(admission.stream(second));
  admission.left(first);
  CHECK(admission.stream(second));
}

TEST_CASE("an address can send a burst of requests, and then requests at its rate") {
  AdmissionControl admission({.requests_per_s = 5.0});
  for (int i = 0; i < 100; ++i) CHECK(admission.retry_after_s("10.0.0.1", kStart) == 0);
  CHECK(admission.retry_after_s("10.0.0.1", kStart) >= 1);
  CHECK(admission.retry_after_s("10.0.0.2", kStart) == 0);
  CHECK(admission.retry_after_s("10.0.0.1", kStart + seconds(1)) == 0);
}

TEST_CASE("the memory for addresses is bounded") {
  AdmissionControl admission({.requests_per_s = 1.0});
  for (int i = 0; i < 100'000; ++i) admission.retry_after_s("10.0.0." + std::to_string(i), kStart);
  CHECK(admission.retry_after_s("10.9.9.9", kStart) == 0);
}

}  // namespace loopwarden::tests::admission_control_test
