// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "daemon/journal/journal.hpp"
#include "daemon/loops/loop_runtime.hpp"
#include "daemon/commands/command_queue.hpp"

namespace loopwarden::daemon {

// A sender's queue of orders to a loop; `box` is the sender's of the loop's channels. `done` is
// called for each order that the loop has taken, after what every order does.
using CommandDone = std::function<void(const rt::Command&, const journal::JournalEntry&)>;
commands::CommandQueue queue_of(LoopRuntime& loop, rt::CommandMailbox& box,
                                journal::Journal& journal, CommandDone done = {});

// Returns the values that the sender's next order will find in force: the loop's, with the sender's
// orders that it has not taken yet.
rt::InForce in_force(const LoopRuntime& loop, commands::CommandQueue& queue);

// The journal's line of a commissioning that this peer has begun or ended.
void write_down_commissioning(const LoopRuntime& loop, bool begun, journal::Journal& journal,
                              std::int64_t utc_ms, const std::string& peer);

}  // namespace loopwarden::daemon
