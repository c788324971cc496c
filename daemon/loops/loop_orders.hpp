// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include "daemon/journal/journal.hpp"
#include "daemon/loops/loop_runtime.hpp"
#include "daemon/orders/order_desk.hpp"

namespace loopwarden::daemon {

// A sender's desk for a loop; `box` is his of the loop's channels. `done` is told each order that was done.
orders::OrderDesk desk_of(LoopRuntime& loop, rt::OrderBox& box, journal::Journal& journal,
                          std::function<void(const rt::Order&)> done = {});

}  // namespace loopwarden::daemon
