// SPDX-License-Identifier: Apache-2.0
// Returns the answer to `registers`: the fields of the register map by name. Values have the order
// of the names: area "box" is under "box", area "loop" under the "values" of each loop.
#pragma once

#include "daemon/console/daemon_info.hpp"
#include "daemon/console/plant.hpp"
#include "daemon/protocol/requests.hpp"

namespace loopwarden::daemon::console {

protocol::Registers registers(const Plant& plant, const DaemonInfo& info,
                              const protocol::RegistersRequest& request);

}  // namespace loopwarden::daemon::console
