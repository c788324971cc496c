// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/io_reader.hpp"

namespace loopwarden::config {

// Reads io with `backend: analog`.
void read_analog(MapReader in, const IoContext& context, IoSection& section);

}  // namespace loopwarden::config
