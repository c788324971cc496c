// SPDX-License-Identifier: Apache-2.0
// Runs a program that has many commands.
#pragma once

#include <CLI/CLI.hpp>

namespace loopwarden::workbench {

// Runs the command that the arguments name and returns the exit code of the program. The commands
// of `app` store theirs in `exit_code`. Prints errors of the arguments and exceptions of the
// command.
int run_program(CLI::App& app, const int& exit_code, int argc, char** argv);

}  // namespace loopwarden::workbench
