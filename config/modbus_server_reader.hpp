// SPDX-License-Identifier: Apache-2.0
// Reads sections of loopwardend.yaml: the Modbus server and the alarms.
#pragma once

#include "config/loop_config.hpp"
#include "config/map_reader.hpp"

namespace loopwarden::config {

ModbusServer read_modbus_server(MapReader& in);
Alarms read_alarms(MapReader& in);

}  // namespace loopwarden::config
