// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/io_reader.hpp"

namespace loopwarden::config {

// io with `backend: modbus`.
void read_modbus(MapReader in, const IoContext& context, IoSection& section);
// The same of a loop that another controller runs.
void read_modbus_source(MapReader in, const IoContext& context, IoSection& section);

}  // namespace loopwarden::config
