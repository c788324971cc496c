// SPDX-License-Identifier: Apache-2.0
// How the daemon runs a command beside its loops (--background): one thread of idle priority, bounded memory and processor time, gone
// with its parent. The result is one sentence on the output; progress comes as lines "progress: WHAT N %" on the error output.
#pragma once

#include "workbench/command_line/command.hpp"

namespace loopwarden::workbench {

void add_background(Command& command, bool& background);
// From now on, for the whole process.
void work_in_background();
bool in_background() noexcept;

}  // namespace loopwarden::workbench
