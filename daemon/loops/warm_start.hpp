// SPDX-License-Identifier: Apache-2.0 How a loop begins after a restart: `start.after_restart` of
// its file, applied to the orders from before it. When in doubt the loop waits in manual.
#pragma once

#include <optional>
#include <string>

#include "config/loop_config.hpp"
#include "daemon/journal/journal_entry.hpp"
#include "daemon/loops/last_commands.hpp"
#include "daemon/rt/control_cycle.hpp"

namespace loopwarden::daemon {

struct WarmStart {
  rt::StartSettings start;
  // For the journal: the values from before the restart, those that were taken, and why. Nothing:
  // the start of the file was taken, and nothing else had been ordered.
  std::optional<journal::JournalEntry> line;
};

// `orders` are those of all loops. Without any, such as at the very first start, the file has the
// say.
WarmStart warm_start(const config::LoopConfig& loop, const LastCommands& commands);

}  // namespace loopwarden::daemon
