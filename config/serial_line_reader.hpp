// SPDX-License-Identifier: Apache-2.0
// Reads the keys of a serial line, which are the same for a link to devices and for the daemon's
// own slave.
#pragma once

#include "config/map_reader.hpp"
#include "hal/modbus/modbus_settings.hpp"

namespace loopwarden::config {

void read_serial_line(MapReader& in, hal::modbus::LinkSettings& line);

}  // namespace loopwarden::config
