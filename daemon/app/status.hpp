// SPDX-License-Identifier: Apache-2.0
// Status of the whole daemon for the sockets and the Modbus server. From any thread.
#pragma once

#include "daemon/gateway/map_values.hpp"
#include "daemon/protocol/answers.hpp"

namespace loopwarden::daemon {

struct Assembly;

// Returns `daemon` of the answer to "status".
protocol::DaemonStatus status_of(const Assembly& parts);
// Returns the answer to "describe", without the loops.
protocol::Description description_of(const Assembly& parts);
// Returns the Modbus lines and addresses in use.
protocol::Links links_of(const Assembly& parts);
// Returns the values for the registers.
gateway::BoxReading box_reading_of(const Assembly& parts);

}  // namespace loopwarden::daemon
