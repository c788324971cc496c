// SPDX-License-Identifier: Apache-2.0
// Lists the addresses that may connect, and those that may write.
#pragma once

#include <sys/socket.h>

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace loopwarden::base {

// An IPv4 or IPv6 address as 16 bytes; IPv4 as the mapped address ::ffff:a.b.c.d.
using Address = std::array<std::uint8_t, 16>;

std::optional<Address> address_of(const sockaddr* socket_address) noexcept;

// A network or one address: "192.168.10.0/24", "::1", "10.0.0.5".
struct Network {
  Address base{};
  unsigned bits = 128;  // of the mapped address
  bool contains(const Address& address) const noexcept;
  friend bool operator==(const Network&, const Network&) = default;
};
// Returns nullopt if the text is no address, or if its prefix has bits set after its length.
std::optional<Network> parse_network(const std::string& text);
// Returns whether the whole text is a numeric address.
bool is_address(const std::string& text);

struct PeerRule {
  Network network;
  bool may_write = false;
  friend bool operator==(const PeerRule&, const PeerRule&) = default;
};

class PeerList {
 public:
  explicit PeerList(std::vector<PeerRule> rules) : rules_(std::move(rules)) {}
  bool may_connect(const Address& address) const noexcept;
  bool may_write(const Address& address) const noexcept;

 private:
  std::vector<PeerRule> rules_;
};

}  // namespace loopwarden::base
