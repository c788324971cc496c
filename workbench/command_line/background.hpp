// SPDX-License-Identifier: Apache-2.0
// Option --background: lets the daemon run a command in parallel to its loops. The process then
// uses one thread of idle priority with bounded memory and processor time, and ends with its
// parent. Standard output carries the result as one sentence. Standard error carries the progress
// as lines "progress: WHAT N %".
#pragma once

#include "workbench/command_line/command.hpp"

namespace loopwarden::workbench {

void add_background(Command& command, bool& background);
// Switches the whole process to background work until it ends.
void work_in_background();
bool in_background() noexcept;

}  // namespace loopwarden::workbench
