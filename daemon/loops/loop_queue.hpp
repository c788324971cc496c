// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "daemon/journal/journal.hpp"
#include "daemon/loops/loop_runtime.hpp"
#include "daemon/commands/command_queue.hpp"

namespace loopwarden::daemon {

// Makes a sender's queue of commands to a loop. `box`: the sender's mailbox in the loop's channels.
// `done` is called for each command that the loop has taken, after the actions that are common to
// all commands.
using CommandDone = std::function<void(const rt::Command&, const journal::JournalEntry&)>;
commands::CommandQueue queue_of(LoopRuntime& loop, rt::CommandMailbox& box,
                                journal::Journal& journal, CommandDone done = {});

// Returns the values that the sender's next command will find in force. These are the loop's
// values, changed by the sender's commands that the loop has not taken yet.
rt::InForce in_force(const LoopRuntime& loop, commands::CommandQueue& queue);

// Writes a line to the journal: this peer has started or ended a commissioning.
void write_down_commissioning(const LoopRuntime& loop, bool begun, journal::Journal& journal,
                              std::int64_t utc_ms, const std::string& peer);

}  // namespace loopwarden::daemon
