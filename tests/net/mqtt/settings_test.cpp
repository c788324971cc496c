// SPDX-License-Identifier: Apache-2.0
// What the client is told: where the broker is, how long to wait.
#include <catch2/catch.hpp>
#include <chrono>
#include <stdexcept>
#include <string>

#include "net/mqtt/back_off.hpp"
#include "net/mqtt/broker_url.hpp"

namespace settings_test {

using namespace loopwarden::mqtt;
using namespace std::chrono_literals;

TEST_CASE("a broker's URL", "[mqtt]") {
  CHECK(parse_broker_url("mqtt://broker") == BrokerUrl{"broker", 1883, false});
  CHECK(parse_broker_url("mqtts://broker") == BrokerUrl{"broker", 8883, true});
  CHECK(parse_broker_url("mqtt://10.0.0.1:1884/") == BrokerUrl{"10.0.0.1", 1884, false});
  CHECK(parse_broker_url("mqtts://[fe80::1]:99") == BrokerUrl{"fe80::1", 99, true});
  CHECK(to_text(parse_broker_url("mqtts://[fe80::1]")) == "mqtts://[fe80::1]:8883");
  CHECK(to_text(parse_broker_url("mqtt://broker")) == "mqtt://broker:1883");
  for (const char* text : {"", "broker", "tcp://broker", "mqtt://", "mqtt://:1883", "mqtt://b:",
                           "mqtt://b:0", "mqtt://b:65536", "mqtt://b:1x", "mqtt://u:p@b",
                           "mqtt://b/path", "mqtt://[::1", "mqtt://[::1]x", "mqtt:// b"}) {
    INFO(text);
    CHECK_THROWS_AS(parse_broker_url(text), std::invalid_argument);
  }
}

TEST_CASE("waits double up to the longest, each with a random part", "[mqtt]") {
  BackOff wait(100ms, 1000ms, 7);
  for (const int upper : {100, 200, 400, 800, 1000, 1000}) {
    const auto drawn = wait.next().count();
    CHECK(drawn >= upper / 2);
    CHECK(drawn <= upper);
  }
  wait.reset();
  CHECK(wait.next() <= 100ms);
}

}  // namespace settings_test
