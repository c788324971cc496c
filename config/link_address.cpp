// SPDX-License-Identifier: Apache-2.0
#include "config/link_address.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>

#include <filesystem>
#include <system_error>

#include "base/text.hpp"

namespace loopwarden::config {

std::string tcp_address(const std::string& host, std::uint64_t port) {
  const std::string name = base::lower_case(host);
  const std::string numeric = name == "localhost" ? "127.0.0.1" : name;
  in6_addr six{};
  if (::inet_pton(AF_INET6, ("::ffff:" + numeric).c_str(), &six) != 1 &&
      ::inet_pton(AF_INET6, numeric.c_str(), &six) != 1) {
    return fmt::format("{} port {}", name, port);
  }
  std::string text;
  for (const unsigned byte : six.s6_addr) text += fmt::format("{:02x}", byte);
  return fmt::format("{} port {}", text, port);
}

std::string serial_address(const std::string& device) {
  std::error_code ignored;
  const std::filesystem::path path = std::filesystem::weakly_canonical(device, ignored);
  return path.empty() ? device : path.string();
}

std::string address_of(const hal::modbus::LinkSettings& link) {
  return link.transport == hal::modbus::Transport::rtu ? serial_address(link.device)
                                                       : tcp_address(link.host, link.port);
}

}  // namespace loopwarden::config
