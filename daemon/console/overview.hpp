// SPDX-License-Identifier: Apache-2.0
// Returns the answer to `overview`: the summary of all loops.
#pragma once

#include <cstdint>

#include "daemon/console/plant.hpp"
#include "daemon/protocol/overview.hpp"

namespace loopwarden::daemon::console {

protocol::Overview overview(const Plant& plant, std::uint32_t config_hash);

}  // namespace loopwarden::daemon::console
