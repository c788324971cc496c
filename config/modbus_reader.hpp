// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/io_reader.hpp"

namespace loopwarden::config {

// io with `backend: modbus`.
void read_modbus(MapReader in, const IoContext& context, IoSection& section);

}  // namespace loopwarden::config
