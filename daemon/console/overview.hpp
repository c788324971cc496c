// SPDX-License-Identifier: Apache-2.0
// All loops at a glance: the answer to `overview`.
#pragma once

#include "daemon/console/parts.hpp"
#include "daemon/protocol/overview.hpp"

namespace loopwarden::daemon::console {

protocol::Overview overview(const Parts& parts);

}  // namespace loopwarden::daemon::console
