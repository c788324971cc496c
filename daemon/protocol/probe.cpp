// SPDX-License-Identifier: Apache-2.0
#include "daemon/protocol/probe.hpp"

#include "daemon/protocol/members.hpp"

namespace loopwarden::protocol {

PROTOCOL_JSON(Probe, transport, host, port, device, baud, parity, stop_bits, unit, table, address,
              type, order)
PROTOCOL_JSON(Probed, state, why, registers, raw)

}  // namespace loopwarden::protocol
