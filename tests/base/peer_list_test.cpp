// SPDX-License-Identifier: Apache-2.0
#include "base/peer_list.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>

#include <catch2/catch.hpp>
#include <string>

namespace peer_list_test {

using namespace loopwarden::base;

namespace {

Address address(const std::string& text) {
  sockaddr_in v4{};
  if (inet_pton(AF_INET, text.c_str(), &v4.sin_addr) == 1) {
    v4.sin_family = AF_INET;
    return *address_of(reinterpret_cast<const sockaddr*>(&v4));
  }
  sockaddr_in6 v6{};
  REQUIRE(inet_pton(AF_INET6, text.c_str(), &v6.sin6_addr) == 1);
  v6.sin6_family = AF_INET6;
  return *address_of(reinterpret_cast<const sockaddr*>(&v6));
}

bool within(const std::string& network, const std::string& host) {
  const auto parsed = parse_network(network);
  REQUIRE(parsed);
  return parsed->contains(address(host));
}

}  // namespace

TEST_CASE("a network contains its addresses and no other", "[os][peers]") {
  CHECK(within("192.168.10.0/24", "192.168.10.0"));
  CHECK(within("192.168.10.0/24", "192.168.10.255"));
  CHECK_FALSE(within("192.168.10.0/24", "192.168.11.0"));
  CHECK_FALSE(within("192.168.10.0/24", "192.168.9.255"));
  CHECK(within("10.0.0.128/25", "10.0.0.200"));
  CHECK_FALSE(within("10.0.0.128/25", "10.0.0.127"));
  CHECK(within("10.0.0.5", "10.0.0.5"));
  CHECK_FALSE(within("10.0.0.5", "10.0.0.4"));
  CHECK(within("0.0.0.0/0", "203.0.113.7"));
  CHECK_FALSE(within("0.0.0.0/0", "2001:db8::1"));  // every IPv4 address, no IPv6 one
  CHECK(within("2001:db8::/32", "2001:db8:ffff::1"));
  CHECK_FALSE(within("2001:db8::/32", "2001:db9::1"));
  CHECK(within("::/0", "2001:db8::1"));
  // An IPv4 client on an IPv6 socket is the IPv4 client.
  CHECK(within("10.0.0.0/8", "::ffff:10.1.2.3"));
}

TEST_CASE("an invalid network is refused", "[os][peers]") {
  const std::string text =
      GENERATE(as<std::string>(), "", "plc", "10.0.0", "10.0.0.0/33", "10.0.0.0/-1", "10.0.0.0/",
               "10.0.0.0/8x", "10.0.0.1/24", "::1/129", "2001:db8::1/32", "/24", "10.0.0.0/8/8");
  INFO(text);
  CHECK_FALSE(parse_network(text));
}

TEST_CASE("an address on no list has no access; one entry is enough to write", "[os][peers]") {
  const PeerList nobody({});
  CHECK_FALSE(nobody.may_connect(address("127.0.0.1")));
  const PeerList list({{*parse_network("10.0.0.0/8"), false}, {*parse_network("10.0.0.7"), true}});
  CHECK(list.may_connect(address("10.1.1.1")));
  CHECK_FALSE(list.may_write(address("10.1.1.1")));
  CHECK(list.may_write(address("10.0.0.7")));
  CHECK_FALSE(list.may_connect(address("11.0.0.1")));
  sockaddr unix_peer{};
  unix_peer.sa_family = AF_UNIX;
  CHECK_FALSE(address_of(&unix_peer));
}

}  // namespace peer_list_test
