// SPDX-License-Identifier: Apache-2.0
// What the sockets and the Modbus server show of the daemon as a whole. Any thread.
#pragma once

#include "daemon/gateway/map_values.hpp"
#include "daemon/protocol/answers.hpp"

namespace loopwarden::daemon {

struct Assembly;

// `daemon` of the request "status".
protocol::DaemonStatus status_of(const Assembly& parts);
// Of the request "describe", without the loops.
protocol::Description description_of(const Assembly& parts);
// On which Modbus lines and addresses it works.
protocol::Links links_of(const Assembly& parts);
// For the registers.
gateway::BoxReading box_reading_of(const Assembly& parts);

}  // namespace loopwarden::daemon
