// SPDX-License-Identifier: Apache-2.0
// Decides how a loop starts after a restart: applies `start.after_restart` of its file to the
// commands from before the restart. In case of doubt the loop waits in manual.
#pragma once

#include <optional>

#include "config/loop_config.hpp"
#include "daemon/journal/journal_entry.hpp"
#include "daemon/loops/last_commands.hpp"
#include "daemon/rt/control_cycle.hpp"

namespace loopwarden::daemon {

struct WarmStart {
  rt::StartSettings start;
  // For the journal: the values from before the restart, the chosen values, and the reason.
  // nullopt: the start of the file was chosen, and no other values had been commanded.
  std::optional<journal::JournalEntry> line;
};

// `commands`: those of all loops. Without commands, as at the very first start, the file decides.
WarmStart warm_start(const config::LoopConfig& loop, const LastCommands& commands);

}  // namespace loopwarden::daemon
