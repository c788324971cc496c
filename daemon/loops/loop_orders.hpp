// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "daemon/journal/journal.hpp"
#include "daemon/loops/loop_runtime.hpp"
#include "daemon/orders/order_desk.hpp"

namespace loopwarden::daemon {

// A sender's desk for a loop; `box` is his of the loop's channels.
orders::OrderDesk desk_of(LoopRuntime& loop, rt::OrderBox& box, journal::Journal& journal);

// The loop is out of service from now on, or in service again, by this peer, which the journal gets.
void put_out_of_service(LoopRuntime& loop, bool is, journal::Journal& journal, std::int64_t utc_ms,
                        const std::string& peer);

}  // namespace loopwarden::daemon
