// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>
#include <stdexcept>
#include <string>

#include "services/net/mqtt/broker_url.hpp"

namespace settings_test {

using namespace loopwarden::mqtt;

TEST_CASE("a broker's URL is read or refused", "[mqtt]") {
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

}  // namespace settings_test
