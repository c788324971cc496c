// SPDX-License-Identifier: Apache-2.0
#include "base/peer_list.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>

#include <algorithm>
#include <charconv>
#include <cstring>

namespace loopwarden::base {
namespace {

constexpr std::array<std::uint8_t, 12> kMapped{0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xFF, 0xFF};

Address mapped(const in_addr& v4) noexcept {
  Address address{};
  std::copy(kMapped.begin(), kMapped.end(), address.begin());
  std::memcpy(address.data() + kMapped.size(), &v4, 4);
  return address;
}

unsigned bit(const Address& address, unsigned at) noexcept {
  const unsigned byte = address[at / 8];
  return (byte >> (7U - at % 8U)) & 1U;
}

}  // namespace

std::optional<Address> address_of(const sockaddr* socket_address) noexcept {
  // Copied, because the buffer that accept() fills has no particular alignment.
  if (socket_address->sa_family == AF_INET) {
    sockaddr_in v4{};
    std::memcpy(&v4, socket_address, sizeof v4);
    return mapped(v4.sin_addr);
  }
  if (socket_address->sa_family == AF_INET6) {
    sockaddr_in6 v6{};
    std::memcpy(&v6, socket_address, sizeof v6);
    Address address{};
    std::memcpy(address.data(), &v6.sin6_addr, address.size());
    return address;
  }
  return std::nullopt;
}

bool Network::contains(const Address& address) const noexcept {
  for (unsigned i = 0; i < bits; ++i) {
    if (bit(address, i) != bit(base, i)) return false;
  }
  return true;
}

std::optional<Network> parse_network(const std::string& text) {
  const std::size_t slash = text.find('/');
  const std::string host = text.substr(0, slash);
  Network network;
  unsigned most = 128;
  in_addr v4{};
  if (inet_pton(AF_INET, host.c_str(), &v4) == 1) {
    network.base = mapped(v4);
    most = 32;
  } else if (inet_pton(AF_INET6, host.c_str(), network.base.data()) != 1) {
    return std::nullopt;
  }
  unsigned bits = most;
  if (slash != std::string::npos) {
    const char* first = text.data() + slash + 1;
    const char* last = text.data() + text.size();
    const auto [end, error] = std::from_chars(first, last, bits);
    if (error != std::errc() || end != last || bits > most) return std::nullopt;
  }
  network.bits = bits + (128 - most);
  for (unsigned i = network.bits; i < 128; ++i) {
    if (bit(network.base, i) != 0) return std::nullopt;
  }
  return network;
}

bool is_address(const std::string& text) {
  return text.find('/') == std::string::npos && parse_network(text).has_value();
}

bool PeerList::may_connect(const Address& address) const noexcept {
  return std::any_of(rules_.begin(), rules_.end(),
                     [&](const PeerRule& rule) { return rule.network.contains(address); });
}

bool PeerList::may_write(const Address& address) const noexcept {
  return std::any_of(rules_.begin(), rules_.end(), [&](const PeerRule& rule) {
    return rule.may_write && rule.network.contains(address);
  });
}

}  // namespace loopwarden::base
