// SPDX-License-Identifier: Apache-2.0
// Returns the device of a Modbus link in one spelling.
#pragma once

#include <string>

#include "hal/modbus/modbus_settings.hpp"

namespace loopwarden::config {

// Returns the device as the file names it: the path of a serial line, or host and port.
std::string spelled_device(const hal::modbus::LinkSettings& link);

// Returns the same text for all spellings of one device: symbolic links are followed. All addresses
// of localhost are the same, because a device may listen by IPv4 and IPv6. Host names are not
// resolved.
std::string device_of(hal::modbus::LinkSettings link);

}  // namespace loopwarden::config
