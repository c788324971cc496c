// SPDX-License-Identifier: Apache-2.0
// The keys of a serial line, the same for a link to devices and for the slave that the daemon is.
#pragma once

#include "config/map_reader.hpp"
#include "hal/modbus/modbus_settings.hpp"

namespace loopwarden::config {

void read_serial_line(MapReader& in, hal::modbus::LinkSettings& line);

}  // namespace loopwarden::config
