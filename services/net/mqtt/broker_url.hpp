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

// Parses mqtt://HOST[:PORT] (default 1883) or mqtts://HOST[:PORT] (TLS, default 8883). An IPv6
// address is written in brackets. User and password are not allowed in the URL. Throws
// std::invalid_argument with the problem.
BrokerUrl parse_broker_url(std::string_view text);
std::string to_text(const BrokerUrl& url);

}  // namespace loopwarden::mqtt
