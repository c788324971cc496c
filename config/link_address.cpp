// SPDX-License-Identifier: Apache-2.0
#include "config/link_address.hpp"

#include <fmt/format.h>

#include "base/device_name.hpp"

namespace loopwarden::config {

using hal::modbus::LinkSettings;

std::string spelled_device(const LinkSettings& link) {
  return link.transport == hal::modbus::Transport::rtu
             ? link.device
             : fmt::format("{} port {}", link.host, link.port);
}

std::string device_of(LinkSettings link) {
  link.device = base::device_name(link.device);
  link.host = base::address_name(link.host);
  if (link.host == "::1") link.host = base::address_name("localhost");
  return spelled_device(link);
}

}  // namespace loopwarden::config
