// SPDX-License-Identifier: Apache-2.0
#include "services/net/mqtt/broker_url.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <stdexcept>

namespace loopwarden::mqtt {
namespace {

[[noreturn]] void refuse(const char* why) {
  throw std::invalid_argument(
      fmt::format("must be mqtt://HOST[:PORT] or mqtts://HOST[:PORT]: {}", why));
}

bool take(std::string_view& text, std::string_view start) {
  if (!text.starts_with(start)) return false;
  text.remove_prefix(start.size());
  return true;
}

std::uint16_t port_of(std::string_view text) {
  std::uint16_t port = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), port);
  if (error != std::errc() || end != text.data() + text.size() || port == 0) {
    refuse("the port is a number from 1 to 65535");
  }
  return port;
}

// Removes the host from the front of `text` and returns it.
std::string host_of(std::string_view& text) {
  const bool bracketed = text.starts_with('[');
  const std::size_t end = bracketed ? text.find(']') : text.find(':');
  if (bracketed && end == std::string_view::npos) refuse("a bracket that is not closed");
  const std::string host(bracketed ? text.substr(1, end - 1) : text.substr(0, end));
  text.remove_prefix(bracketed ? end + 1 : std::min(end, text.size()));
  if (host.empty()) refuse("no host");
  return host;
}

}  // namespace

BrokerUrl parse_broker_url(std::string_view text) {
  BrokerUrl url;
  if (take(text, "mqtts://")) {
    url.tls = true;
    url.port = 8883;
  } else if (!take(text, "mqtt://")) {
    refuse("it begins with neither");
  }
  if (text.find('@') != std::string_view::npos) {
    refuse("user and password are given as files or credentials");
  }
  if (text.ends_with('/')) text.remove_suffix(1);
  if (text.find_first_of("/?# ") != std::string_view::npos) refuse("there is no path");
  url.host = host_of(text);
  if (take(text, ":")) {
    url.port = port_of(text);
  } else if (!text.empty()) {
    refuse("only a port may follow the host");
  }
  return url;
}

std::string to_text(const BrokerUrl& url) {
  const bool address = url.host.find(':') != std::string::npos;
  return fmt::format("{}://{}{}{}:{}", url.tls ? "mqtts" : "mqtt", address ? "[" : "", url.host,
                     address ? "]" : "", url.port);
}

}  // namespace loopwarden::mqtt
