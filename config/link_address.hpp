// SPDX-License-Identifier: Apache-2.0
// Whether two links reach the same device or line, however their addresses are written.
#pragma once

#include <cstdint>
#include <string>

#include "hal/modbus/modbus_settings.hpp"

namespace loopwarden::config {

// Returns an address in the one form that all its spellings have: the port with the address in bytes, `localhost` and IPv4
// within IPv6 included; a serial device without symbolic links. A host name stays a name: nothing is looked up.
std::string tcp_address(const std::string& host, std::uint64_t port);
std::string serial_address(const std::string& device);
std::string address_of(const hal::modbus::LinkSettings& link);

}  // namespace loopwarden::config
