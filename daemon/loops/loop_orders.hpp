// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "daemon/journal/journal.hpp"
#include "daemon/loops/loop_runtime.hpp"
#include "daemon/orders/order_desk.hpp"

namespace loopwarden::daemon {

// A sender's desk for a loop; `box` is his of the loop's channels.
orders::OrderDesk desk_of(LoopRuntime& loop, rt::OrderBox& box, journal::Journal& journal);

}  // namespace loopwarden::daemon
