// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace loopwarden::mqtt {

struct BrokerUrl {
  std::string host;
  std::uint16_t port = 1883;
  bool tls = false;
  friend bool operator==(const BrokerUrl&, const BrokerUrl&) = default;
};

// mqtt://HOST[:PORT] (1883) or mqtts://HOST[:PORT] (TLS, 8883); an IPv6 address stands in brackets. Throws
// std::invalid_argument that says what is wrong; user and password have no place here.
BrokerUrl parse_broker_url(std::string_view text);
std::string to_text(const BrokerUrl& url);

}  // namespace loopwarden::mqtt
