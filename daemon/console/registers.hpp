// SPDX-License-Identifier: Apache-2.0
// The answer to `registers`: the fields of the register map by name. Values are in the order of the
// names: those of area "box" under "box", those of area "loop" under each loop's "values".
#pragma once

#include "daemon/console/daemon_info.hpp"
#include "daemon/console/plant.hpp"
#include "protocol/requests.hpp"

namespace loopwarden::daemon::console {

protocol::Registers registers(const Plant& plant, const DaemonInfo& info,
                              const protocol::RegistersRequest& request);

}  // namespace loopwarden::daemon::console
