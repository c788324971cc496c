// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/io_reader.hpp"

namespace loopwarden::config {

// Reads io with `backend: modbus`.
void read_modbus(MapReader in, const IoContext& context, IoSection& section);
// Reads the same for a loop that another controller runs.
void read_modbus_source(MapReader in, const IoContext& context, IoSection& section);

}  // namespace loopwarden::config
